// SPDX-License-Identifier: MIT
// The outline of a netlist: its instances with the pins that the text mentions, its threads with
// their functions, its signals.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "lsp/netlist_index.hpp"
#include "lsp/text_document.hpp"

namespace hal::tools {

/// Returns the DocumentSymbols of a text. [setup]
nlohmann::json outline(const NetlistIndex& index, const TextDocument& document,
                       const std::string& path);

}  // namespace hal::tools
