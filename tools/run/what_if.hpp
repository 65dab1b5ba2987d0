// SPDX-License-Identifier: MIT
// `hal replay --exact FILE --edit 'setp NAME VALUE' --at CYCLE`: the same inputs, another value; or
// another netlist.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "journal/journal_file.hpp"
#include "journal/re_execution.hpp"
#include "machine/session.hpp"
#include "run/netlist_change.hpp"
#include "run/replay.hpp"
#include "run/stop_rule.hpp"

namespace hal::tools {

/// Values that are set at one moment of a re-execution. [setup]
class WhatIf {
public:
    /// Returns why --edit or --at is invalid; "" when both are good, or missing.
    std::string parse(const ReplayOptions& options);
    bool empty() const { return edits_.empty() && netlist_.empty(); }
    /// Returns the netlist that the machine changes to; empty: it stays.
    const NetlistChange& netlist() const { return netlist_; }

    /// Returns true when the values are to be set before the next cycle: once.
    bool is_due(const JournaledCycle& newest, const std::string& fastest) const {
        return !empty() && !done_ && at_.reached(newest, fastest);
    }
    /// Changes the machine and sets the values, between two cycles; a netlist needs a machine at
    /// rest. Returns why not; "" when it is done.
    std::string apply(Session& session, ReExecution& execution, const JournalFile& file);
    bool done() const { return done_.has_value(); }
    /// Returns the newest cycle before the values were set.
    const JournaledCycle& since() const { return *done_; }

private:
    struct Assignment {
        bool of_signal;
        std::string name;
        std::string value;
    };
    std::string set_values(Session& session) const;

    std::vector<Assignment> edits_;
    NetlistChange netlist_;
    JournalPosition at_;
    std::optional<JournaledCycle> done_;
};

/// Names the inputs in the journal that come from outside of the machine, separated by commas; ""
/// when it has none but the time.
std::string outside_inputs(const JournalFile& file);

}  // namespace hal::tools
