hal check --linuxcnc linuxcnc-threads.hal
