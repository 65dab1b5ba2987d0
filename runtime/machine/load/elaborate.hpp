// SPDX-License-Identifier: MIT
// What carries out the commands that change the model: the functions of the command table's edits.
// Step 3 of docs/design.md.
#pragma once

#include <span>
#include <vector>

#include "machine/load/plugins.hpp"
#include "model/edit.hpp"
#include "netlist/netlist.hpp"
#include "netlist/usage.hpp"
#include "text/diagnostic.hpp"

namespace hal {

class Transaction;

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
    const Usage& usage;  ///< of the command, for messages
    bool check_only = false;  ///< `hal check`: code that may access hardware does not run
    Transaction* transaction = nullptr;  ///< whose edits these are
    const hal_faults* faults = nullptr;  ///< the fault record of the machine
    bool hardware_allowed = true;  ///< false: constructors must not access hardware
};

/// Carries out `addf --auto`.
void apply_auto_order(Model& model, Edit& edit, const std::vector<AutoOrder>& orders,
                      Diagnostics& diagnostics);

/// Each carries out one plain (expanded) command on the model. The number of arguments is right;
/// arrows are still among them. Problems go to the diagnostics.
namespace edits {

using Args = std::span<const Token>;

inline Word word(const Token& token) { return {token.text, token.span}; }

void addf(Elaboration& on, Args args);
void alias(Elaboration& on, Args args);
void delf(Elaboration& on, Args args);
void delsig(Elaboration& on, Args args);
void delthread(Elaboration& on, Args args);
void initf(Elaboration& on, Args args);
void linkpp(Elaboration& on, Args args);
void linkps(Elaboration& on, Args args);
void linksp(Elaboration& on, Args args);
void loadrt(Elaboration& on, Args args);
void net(Elaboration& on, Args args);
void newsig(Elaboration& on, Args args);
void newthread(Elaboration& on, Args args);
void reload(Elaboration& on, Args args);
void setp(Elaboration& on, Args args);
void sets(Elaboration& on, Args args);
void unalias(Elaboration& on, Args args);
void unlinkp(Elaboration& on, Args args);
void unload(Elaboration& on, Args args);

}  // namespace edits

}  // namespace hal
