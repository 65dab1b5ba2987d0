hal sim nothing-ran-no-function.hal --for 10ms -q
