hal sim -q lost-writer-several.hal --for 1ms
