hal sim program-failed.hal
