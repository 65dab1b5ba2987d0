// SPDX-License-Identifier: MIT
// The machine of a journal, whose cycles are executed again and compared.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "journal/journal_file.hpp"
#include "journal/re_execution.hpp"
#include "run/hosted_machine.hpp"
#include "run/replay.hpp"
#include "run/value_check.hpp"
#include "run/what_if.hpp"

namespace hal::tools {

/// [setup]. Members are called with the session's lock held.
class ReplayedMachine {
public:
    enum class Compare : std::uint8_t { values, checksums };

    /// Both outlive it. With Compare::values, the values that were recorded with the journal are
    /// compared, too. `is_copied`: see Execution.
    ReplayedMachine(const ReplayOptions& options, JournalFile& file, Compare compare,
                    WhatIf change = {}, bool is_copied = false);

    Session& session() { return machine_.session; }
    HostedMachine& host() { return machine_; }
    ReExecution& execution() { return execution_; }
    const ReExecution& execution() const { return execution_; }
    /// Returns the name of the thread with the shortest period; "" when there is none.
    const std::string& fastest() const { return fastest_; }
    /// Returns the change of --edit.
    const WhatIf& change() const { return change_; }
    /// Returns why the change cannot be made; "" when it can.
    const std::string& change_problem() const { return change_problem_; }
    /// Describes what the change has caused so far; "" before it.
    std::string consequences() const;
    /// Executes one cycle. Returns false when it was not possible, or something differs that
    /// --edit has not caused.
    bool advance();
    /// Compares what has been executed. Returns false when a value differs.
    bool compare() { return !values_ || values_->compare(); }
    /// Returns how many recorded values were compared; nothing when none are recorded.
    std::optional<std::uint64_t> compared() const;
    const ValueDifference* value_difference() const;
    /// Names the first difference; "" when there is none.
    std::string difference() const;
    /// After a difference that no recorded value names: executes further cycles until one differs.
    /// Returns what names it; "" when none does.
    std::string later_difference();
    /// Returns the pin that the value is computed for; nullptr: no component computes it.
    const Pin* writer(const std::string& name) const;
    /// Returns the function that computes this value; nullptr: unknown.
    const LoadedFunction* function_of(const std::string& name) const;

private:
    bool make_change();
    void begin_values(const std::vector<std::string>& names);
    std::string value_text(const ValueDifference& at, const char* title) const;
    std::string function_text(const std::string& name) const;

    const ReplayOptions& options_;
    JournalFile& file_;
    const bool with_values_;
    const std::string fastest_;
    ReExecution execution_;
    ReplayOptions machine_options_;
    HostedMachine machine_;
    std::unique_ptr<ValueCheck> values_;
    WhatIf change_;
    std::string change_problem_;
    std::uint64_t uncompared_ = 0;  // cycles since the last comparison
};

}  // namespace hal::tools
