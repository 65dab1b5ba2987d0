hal sim no-program.hal
