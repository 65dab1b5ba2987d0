# packages: modbus
hal modbus check modbus-value.modbus
