hal sim nothing-ran.hal
