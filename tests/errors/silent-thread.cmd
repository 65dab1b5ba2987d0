halrun silent-thread.hal
