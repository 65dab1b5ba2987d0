// SPDX-License-Identifier: MIT
#include "bus/ethercat/keys.hpp"

#include "cli/output.hpp"
#include "ethercat/config/config.hpp"

namespace hal::tools {

int run_ethercat_keys(const Options&) {
    return exit_code(print("## [bus]\n\n" + ethercat::config::bus_reference() + "\n" +
                           "## [slave POSITION NAME]\n\n" + ethercat::config::slave_reference() +
                           "\n" + "## process data of a slave\n\n" +
                           ethercat::config::process_data_reference() + "\n" +
                           "## clock of a slave\n\n" + ethercat::config::clock_reference() + "\n" +
                           "## OBJECT. of a slave\n\n" + ethercat::config::object_reference()));
}

}  // namespace hal::tools
