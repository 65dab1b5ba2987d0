hal check ini-without-netlist.ini
