hal sim -k no-latency.hal
