hal sim no-thread.hal
