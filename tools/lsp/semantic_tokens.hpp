// SPDX-License-Identifier: MIT
// Colours by meaning: which words of a netlist are commands, components, signals, pins.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "lsp/netlist_index.hpp"
#include "lsp/text_document.hpp"

namespace hal::tools {

/// Returns the legend: the names of the types in the order of their numbers. [any]
nlohmann::json semantic_legend();

/// Returns the SemanticTokens of a range of a text. [setup]
nlohmann::json semantic_tokens(const NetlistIndex& index, const TextDocument& document,
                               const std::string& path, TextRange range);

}  // namespace hal::tools
