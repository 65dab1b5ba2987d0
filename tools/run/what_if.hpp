// SPDX-License-Identifier: MIT
// `hal replay --exact FILE --edit 'setp NAME VALUE' --at CYCLE`: the same inputs, another value.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "journal/journal_file.hpp"
#include "journal/re_execution.hpp"
#include "machine/session.hpp"
#include "run/replay.hpp"
#include "run/stop_rule.hpp"

namespace hal::tools {

/// Values that are set at one moment of a re-execution. [setup]
class WhatIf {
public:
    /// Returns why --edit or --at is invalid; "" when both are good, or missing.
    std::string parse(const ReplayOptions& options);
    bool empty() const { return edits_.empty(); }

    /// Returns true when the values are to be set before the next cycle: once.
    bool is_due(const JournaledCycle& newest, const std::string& fastest) const {
        return !empty() && !done_ && at_.reached(newest, fastest);
    }
    /// Sets the values, between two cycles. Returns why one cannot be set; "" when all are.
    std::string apply(Session& session, const JournaledCycle& newest);
    bool done() const { return done_.has_value(); }
    /// Returns the newest cycle before the values were set.
    const JournaledCycle& since() const { return *done_; }

private:
    struct Assignment {
        bool of_signal;
        std::string name;
        std::string value;
    };
    std::vector<Assignment> edits_;
    JournalPosition at_;
    std::optional<JournaledCycle> done_;
};

/// Names the inputs in the journal that come from outside of the machine, separated by commas; ""
/// when it has none but the time.
std::string outside_inputs(const JournalFile& file);

}  // namespace hal::tools
