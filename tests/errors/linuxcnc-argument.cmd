hal check --linuxcnc linuxcnc-argument.hal
