# packages: canopen
hal canopen plan canopen-line.canopen
