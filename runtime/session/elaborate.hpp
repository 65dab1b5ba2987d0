// SPDX-License-Identifier: MIT
// The commands that change the model: one row each. Step 2 of docs/design.md.
#pragma once

#include <string_view>
#include <vector>

#include "base/diagnostic.hpp"
#include "model/edit.hpp"
#include "netlist/netlist.hpp"
#include "session/plugins.hpp"

namespace hal {

/// Functions that `addf --auto` placed in a thread; put in order when the transaction is complete.
struct AutoOrder {
    Thread* thread;
    std::vector<LoadedFunction*> functions;
    Span at;
};

struct Elaboration {
    Model& model;
    Edit& edit;
    const Plugins& plugins;
    Sources& sources;
    Diagnostics& diagnostics;
    std::vector<AutoOrder>& auto_orders;
};

/// True for a command this layer executes.
bool is_edit(const Command& command);
/// Executes one plain (expanded) command on the model. Problems go to the diagnostics.
void elaborate(Elaboration& on, const Command& command);
/// Carries out `addf --auto`.
void apply_auto_order(Model& model, Edit& edit, const std::vector<AutoOrder>& orders, Diagnostics& diagnostics);

}  // namespace hal
