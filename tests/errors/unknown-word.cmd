hal sim unknown-word.hal
