hal check --linuxcnc linuxcnc-name.hal
