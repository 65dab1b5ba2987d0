// SPDX-License-Identifier: MIT
// What has to be sent to a running machine after its netlist was edited.
#pragma once

#include <string>
#include <vector>

#include "lsp/text_document.hpp"
#include "netlist/netlist.hpp"

namespace hal::tools {

struct NetlistChanges {
    /// commands that undo the removed lines: unlinkp, delf, delsig
    std::string removed;
    /// the new text with its changed lines only, each at its number
    std::string changed;
    std::size_t lines = 0;  ///< that changed, the removed ones included
    /// removed or changed lines that cannot be sent, each with the reason
    std::vector<std::string> not_sent;
};

/// Compares two texts of a netlist. Lines that only move are equal. `ini` is for [SECTION]KEY. [setup]
NetlistChanges netlist_changes(const std::string& before, const std::string& after, const Ini& ini);

}  // namespace hal::tools
