hal sim -q lost-writer.hal --for 1ms
