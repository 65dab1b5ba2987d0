// SPDX-License-Identifier: MIT
// Renaming a signal, an instance or a thread in all texts of a netlist, and in INI files whose
// values are its name.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "lsp/netlist_index.hpp"
#include "lsp/workspace.hpp"

namespace hal::tools {

struct TextEdit {
    TextRange range;
    std::string text;
    auto operator<=>(const TextEdit&) const = default;
};

/// By canonical path.
using FileEdits = std::map<std::string, std::vector<TextEdit>>;

/// Throws protocol::RequestError with the reason when the name cannot be changed. [setup]
void check_renaming(const NetlistIndex& index, const NamedThing& thing);

/// Returns the edits. Throws protocol::RequestError when the new name is invalid or taken, when a
/// mention is not in a text as such, or when the renamed netlist would have an error that the
/// present one does not have. [setup]
FileEdits rename(const Workspace& workspace, const CheckedNetlist& netlist,
                 const NetlistIndex& index, const NamedThing& thing, const std::string& new_name);

}  // namespace hal::tools
