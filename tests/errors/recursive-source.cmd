hal sim recursive-source.hal
