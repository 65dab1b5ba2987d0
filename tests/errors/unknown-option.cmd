hal sim unknown-option.hal
