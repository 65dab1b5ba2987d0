hal sim locked.hal
