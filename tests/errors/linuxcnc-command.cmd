hal check --linuxcnc linuxcnc-command.hal
