hal check --linuxcnc linuxcnc-value.hal
