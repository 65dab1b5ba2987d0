hal check modbus-value.modbus mesa-value.mesa
