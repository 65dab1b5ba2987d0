hal sim unknown-command.hal
