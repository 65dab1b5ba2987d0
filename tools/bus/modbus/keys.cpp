// SPDX-License-Identifier: MIT
#include "bus/modbus/keys.hpp"

#include "cli/output.hpp"
#include "modbus/config/bus_config.hpp"

namespace hal::tools {

int run_modbus_keys(const Options&) {
    return exit_code(print("## [bus]\n\n" + modbus::bus_reference() + "\n" +
                           "## [slave ID NAME]\n\n" + modbus::slave_reference() + "\n" +
                           "## [drive ID NAME]\n\n" + modbus::drive_reference()));
}

}  // namespace hal::tools
