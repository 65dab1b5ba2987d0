hal sim cannot-write.hal
