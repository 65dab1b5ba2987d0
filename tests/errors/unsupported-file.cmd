hal check unsupported-file.tcl
