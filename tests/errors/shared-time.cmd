hal sim shared-time.hal
