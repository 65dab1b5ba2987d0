hal sim unsupported-file.tcl
