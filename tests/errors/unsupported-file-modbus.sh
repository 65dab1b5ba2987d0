# SPDX-License-Identifier: MIT
# configurations of buses that a netlist loads
hal check modbus-value.modbus mesa-value.mesa
