hal sim is-a-program.hal
