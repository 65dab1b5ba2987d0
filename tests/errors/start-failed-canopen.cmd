hal sim start-failed-canopen.hal --for 1ms
