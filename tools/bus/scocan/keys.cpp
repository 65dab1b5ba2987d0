// SPDX-License-Identifier: MIT
#include "bus/scocan/keys.hpp"

#include "cli/output.hpp"
#include "fieldbus/scocan/config/table.hpp"

namespace hal::tools {

int run_scocan_keys(const Options&) {
    return exit_code(print("## the bus\n\n" + scocan::reference() + "\n" + "## a message\n\n" +
                           scocan::message_reference()));
}

}  // namespace hal::tools
