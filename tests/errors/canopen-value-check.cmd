# packages: canopen
hal canopen check canopen-value.canopen
