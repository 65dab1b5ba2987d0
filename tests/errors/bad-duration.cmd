hal sim bad-duration.hal
