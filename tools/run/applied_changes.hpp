// SPDX-License-Identifier: MIT
// What has to be sent to a running machine after its netlist was edited.
#pragma once

#include <string>
#include <vector>

#include "netlist/netlist.hpp"

namespace hal::tools {

struct NetlistChanges {
    /// commands that undo the removed lines: unlinkp, delf, delsig
    std::string removed;
    /// the new text with its changed lines only, each at its number
    std::string changed;
    /// what takes effect with the next start only, each with the reason: lines that cannot be
    /// sent, or that have moved, and what removed lines made
    std::vector<std::string> not_sent;
};

/// Compares two texts of a netlist. A function, or a last value, whose line only moved is sent
/// again where the order of lines matters. `ini` is for [SECTION]KEY. [setup]
NetlistChanges netlist_changes(const std::string& before, const std::string& after, const Ini& ini);

}  // namespace hal::tools
