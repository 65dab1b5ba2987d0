hal sim program-timeout.hal
