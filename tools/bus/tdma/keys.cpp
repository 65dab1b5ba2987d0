// SPDX-License-Identifier: MIT
#include "bus/tdma/keys.hpp"

#include "cli/output.hpp"
#include "fieldbus/tdma/config/schedule.hpp"

namespace hal::tools {

int run_tdma_keys(const Options&) {
    return exit_code(print("## the segment\n\n" + tdma::config::segment_reference() + "\n" +
                           "## a station\n\n" + tdma::config::station_reference()));
}

}  // namespace hal::tools
