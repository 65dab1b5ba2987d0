hal sim program-ended.hal
