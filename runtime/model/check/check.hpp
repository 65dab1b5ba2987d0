// SPDX-License-Identifier: MIT
// The rules over a whole model: one file per rule. (What a single edit can break is rejected in
// model/edit.)
#pragma once

#include <string>
#include <vector>

#include "model/model.hpp"
#include "text/diagnostic.hpp"

namespace hal {

/// error period-multiple
void check_periods(const Model& model, Diagnostics& diagnostics);
/// error spread-pins
void check_spread_pins(const Model& model, Diagnostics& diagnostics);
/// warning repeated-function in one thread, error in two
void check_repeated_steps(const Model& model, Diagnostics& diagnostics);
/// warning wrong-arrow
void check_arrows(const Model& model, Diagnostics& diagnostics);
/// Which functions the next check looks at.
enum class Unthreaded {
    all,
    removed,  ///< those that were in a thread after the last commit
};
/// warning unthreaded-function
void check_unthreaded_functions(const Model& model, Unthreaded which, Diagnostics& diagnostics);
/// warning lost-writer: signals that had a writer after the last commit and have readers only
void check_lost_writers(const Model& model, Diagnostics& diagnostics);
/// note cross-thread-io
void check_cross_thread_io(const Model& model, Diagnostics& diagnostics);
void check_stale_reads(const Model& model, Diagnostics& diagnostics);  ///< note stale-read

/// How old a value is when a function reads it: the table in docs/design.md.
struct Delay {
    const Signal* signal;
    const Pin *writer, *reader;
    enum class Kind { same_cycle, next_cycle, other_thread, session, cell, unscheduled } kind;
};
std::vector<Delay> delays(const Model& model);

/// Where a pin's function stands in its thread: the last position of a writer's, the first of a
/// reader's functions.
int first_position(const Pin& pin);
int last_position(const Pin& pin);

}  // namespace hal
