// SPDX-License-Identifier: MIT
// What stands in an address `cane:PLACE?key=value`.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cane/format.hpp"

namespace hal::can::cane {

struct Settings {
    std::string segment;              ///< address of the Ethernet segment, without options
    std::string segment_options;      ///< "?mac=…", or empty
    Format format = Format::packed;
    Order order = Order::big;
    std::optional<unsigned> slot;     ///< of the discipline on the segment; nothing: frames leave at once
    unsigned priority = 8;            ///< of process data in the slot; SDO, heartbeats and LSS are behind it
    bool learns = true;
    bool produced_to_master = false;
    std::vector<std::pair<unsigned, ethernet::Address>> nodes;
};

/// Reads it; what is wrong, or nothing. [setup]
std::string parse(std::string_view place, Settings&);

}  // namespace hal::can::cane
