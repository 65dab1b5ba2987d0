// SPDX-License-Identifier: MIT
// The settings in an address `cane:PLACE?key=value`.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cane_format.hpp"

namespace hal::can::cane {

/// The settings of a link.
struct Settings {
    std::string segment;              ///< address of the Ethernet segment, without options
    std::string segment_options;      ///< "?mac=…", or empty
    Format format = Format::packed;
    Order order = Order::big;
    /// slot of the discipline on the segment; none: frames are sent at once
    std::optional<unsigned> slot;
    /// priority of process data in the slot; SDO, heartbeats and LSS have the next lower one
    unsigned priority = 8;
    bool learns = true;
    bool produced_to_master = false;
    std::vector<std::pair<unsigned, ethernet::Address>> nodes;
    std::optional<ethernet::Address> master;  ///< the only station that may command; none: learnt
    std::vector<ethernet::Address> also;  ///< further stations that may command
    std::optional<Key> key;  ///< signs all frames
};

/// Parses `target` and sets the segment in any case. Returns the problem, or "". With `read_key` it
/// also reads the file of `key=`. [setup]
std::string parse(std::string_view target, Settings&, bool read_key = true);

}  // namespace hal::can::cane
