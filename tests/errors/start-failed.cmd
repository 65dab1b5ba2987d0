hal sim start-failed.hal --for 1ms
