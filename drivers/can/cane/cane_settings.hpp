// SPDX-License-Identifier: MIT
// What stands in an address `cane:PLACE?key=value`.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cane_format.hpp"

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
    std::optional<ethernet::Address> master;  ///< who alone may command; nothing: it is learnt
    std::vector<ethernet::Address> also;      ///< who may, too
    std::optional<Key> key;                   ///< all frames are signed with it
};

/// Reads it; returns what is wrong, or nothing. The segment is set in any case. `read_key`: also reads the file of `key=`. [setup]
std::string parse(std::string_view place, Settings&, bool read_key = true);

}  // namespace hal::can::cane
