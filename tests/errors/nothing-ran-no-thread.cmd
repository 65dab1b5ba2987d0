hal sim nothing-ran-no-thread.hal
