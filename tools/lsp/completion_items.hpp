// SPDX-License-Identifier: MIT
// Completion in an editor: what the shell offers, as the protocol sends it.
#pragma once

#include <nlohmann/json.hpp>

#include "lsp/checked_netlist.hpp"
#include "lsp/text_document.hpp"

namespace hal::tools {

/// Returns a CompletionList for a position of a netlist; `model` has the names. [setup]
nlohmann::json complete_netlist(CheckedNetlist& model, const TextDocument& document,
                                TextPosition at);

}  // namespace hal::tools
