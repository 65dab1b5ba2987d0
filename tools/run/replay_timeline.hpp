// SPDX-License-Identifier: MIT
// What a journal has, from its begin to its end: threads, cycles, and marks of what happened.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "journal/journal_file.hpp"

namespace hal::tools {

/// Marks are known as far as the journal has been executed. [setup]
class ReplayTimeline {
public:
    static constexpr std::size_t max_marks = 10'000;  ///< of faults, and of all others

    /// Before the journal is executed.
    explicit ReplayTimeline(JournalFile& file);

    /// Adds what the executing process has found. Returns false for what is known already, and
    /// beyond max_marks: it is counted.
    bool add(std::string_view mark);
    /// Returns the number of cycles that are executed after the first fault behind `cycles`, or
    /// before it; 0: none is known.
    std::uint64_t fault_after(std::uint64_t cycles) const;
    std::uint64_t fault_before(std::uint64_t cycles) const;
    /// Returns false once faults were only counted.
    bool has_all_faults() const { return faults_.left_out == 0; }
    /// Returns how many marks were only counted.
    std::size_t left_out() const { return faults_.left_out + others_.left_out; }
    /// Returns the members of docs/protocol.md, "moment".
    nlohmann::ordered_json json() const;
    /// Returns the name of the journal's file, without its folder.
    std::string file_name() const { return head_.at("file").get<std::string>(); }
    /// Returns the time of the last cycle.
    std::int64_t end_ns() const { return end_ns_; }
    /// Returns the Unix time of the first cycle.
    std::int64_t begin_unix_ns() const { return begin_unix_ns_; }

private:
    struct Mark {
        std::uint64_t cycles;
        bool is_fault;
        nlohmann::ordered_json json;
    };
    struct Count {
        std::size_t kept = 0;
        std::size_t left_out = 0;
    };
    bool is_known(std::uint64_t cycles, const nlohmann::ordered_json& mark) const;

    nlohmann::ordered_json head_;
    std::vector<Mark> marks_;  // in the order of their cycles
    Count faults_;
    Count others_;
    std::int64_t end_ns_ = 0;
    std::int64_t begin_unix_ns_ = 0;
};

}  // namespace hal::tools
