// SPDX-License-Identifier: MIT
// What an editor shows about the name under the cursor.
#pragma once

#include <string>

#include "lsp/netlist_index.hpp"

namespace hal::tools {

/// Returns Markdown about a name: type, direction, unit, manual; empty when nothing is known of it.
/// [setup]
std::string hover_text(const NetlistIndex& index, CheckedNetlist& model, const NamedThing& thing);

}  // namespace hal::tools
