hal sim no-such-thread-timing.hal
