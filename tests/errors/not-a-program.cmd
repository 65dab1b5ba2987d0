hal sim not-a-program.hal
