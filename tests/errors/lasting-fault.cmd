hal sim lasting-fault.hal
