# packages: scocan
hal scocan plan scocan-value.scocan
