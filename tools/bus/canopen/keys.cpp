// SPDX-License-Identifier: MIT
#include "bus/canopen/keys.hpp"

#include "canopen/master/config/master_config.hpp"
#include "cli/output.hpp"

namespace hal::tools {

int run_canopen_keys(const Options&) {
    return exit_code(print("## [bus]\n\n" + canopen::config::bus_reference() + "\n" +
                           "## [node ID NAME]\n\n" + canopen::config::node_reference() + "\n" +
                           "## rpdoN., tpdoN. of a node\n\n" + canopen::config::pdo_reference() +
                           "\n" + "## srdoN. of a node\n\n" + canopen::config::srdo_reference() +
                           "\n" + "## INDEX:SUB. of a node\n\n" +
                           canopen::config::object_reference()));
}

}  // namespace hal::tools
