puts "a Tcl script"
