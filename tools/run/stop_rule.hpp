// SPDX-License-Identifier: MIT
// Where a re-execution stops: a cycle, a time or a condition.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "journal/re_execution.hpp"
#include "machine/session.hpp"

namespace hal::tools {

/// 'NAME > VALUE'. [setup]
class ValueCondition {
public:
    /// Returns false when the text is not a condition.
    bool parse(const std::string& text);
    bool empty() const { return name_.empty(); }
    const std::string& name() const { return name_; }
    /// Returns whether it holds now; false when the machine has no such name. The session's lock
    /// must be held.
    bool holds(Session& session) const;
    /// Returns true when the machine has no such name. The session's lock must be held.
    bool is_unknown(const Session& session) const;
    static constexpr const char* form = "write 'NAME > VALUE', with one of > < >= <= == !=";

private:
    std::string name_;
    std::string operator_;
    double value_ = 0;
};

/// "12000": a cycle of the fastest thread, or "3.5s": a time since the begin. [setup]
class JournalPosition {
public:
    /// Returns false when the text is neither.
    bool parse(const std::string& text);
    bool empty() const { return !cycle_ && !time_ns_; }
    bool reached(const JournaledCycle& newest, const std::string& fastest) const;
    /// The same by numbers: the newest cycle of the fastest thread, and the newest time.
    bool reached(std::uint64_t fastest_cycle, std::int64_t time_ns) const;

private:
    std::optional<std::uint64_t> cycle_;
    std::optional<std::int64_t> time_ns_;
};

}  // namespace hal::tools
