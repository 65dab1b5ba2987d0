# packages: scocan
hal scocan plan scocan-slots-deadline.scocan
