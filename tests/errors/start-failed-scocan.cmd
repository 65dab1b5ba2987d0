hal sim start-failed-scocan.hal --for 1ms
