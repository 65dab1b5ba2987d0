hal canopen check canopen-value-parameter.canopen
