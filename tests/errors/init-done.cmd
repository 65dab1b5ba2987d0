hal sim init-done.hal --for 1ms
