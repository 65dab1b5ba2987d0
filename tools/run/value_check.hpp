// SPDX-License-Identifier: MIT
// Compares the values that were recorded with a journal with those of its re-execution.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "machine/session.hpp"
#include "recording/mcap/recording.hpp"

namespace hal::tools {

/// The first row that differs, and the value in it whose function runs first.
struct ValueDifference {
    std::string name;
    std::string thread;
    std::uint64_t cycle = 0;
    std::int64_t time_ns = 0;  ///< on the clock of the journaled machine
    hal_type type = HAL_TYPE_BIT;
    std::uint64_t recorded = 0;
    std::uint64_t executed = 0;
    std::size_t others = 0;  ///< further values that differ in the same row
};

/// [setup], with the session's lock held.
class ValueCheck {
public:
    /// Reads the recorded values; see problem(). `unix_offset_ns`: from the clock of the journaled
    /// machine to Unix time.
    ValueCheck(const std::string& path, std::int64_t unix_offset_ns);
    const std::string& problem() const { return problem_; }

    /// The values of these names are recorded from here on.
    void begin(Session& session, const std::vector<std::string>& names);
    /// Compares what was executed since the last call. Returns false when something differs, now or
    /// before.
    bool compare();
    const std::optional<ValueDifference>& difference() const { return difference_; }
    std::uint64_t values() const { return values_; }  ///< compared so far

private:
    /// One recorded table, and the next of its rows.
    struct Position {
        const mcap::Table* table;
        std::size_t row = 0;
        /// index in an executed row and in a recorded one; empty: to be found
        std::vector<std::pair<std::size_t, std::size_t>> pairs = {};
    };
    struct Row {
        std::string thread;
        std::uint64_t cycle;
        std::int64_t time_ns;
        const std::vector<std::size_t>* columns;
        const std::uint64_t* words;
    };
    void compare(const ProbeRows& rows);
    void compare(const Row& row);
    std::vector<std::pair<std::size_t, std::size_t>> pairs_of(
        const mcap::Table& table, const std::vector<std::size_t>& columns) const;
    std::size_t rank(const std::string& name) const;

    const std::int64_t unix_offset_ns_;
    std::string problem_;
    mcap::Recording recording_;
    /// by thread, then by column: tables of one thread follow each other in time
    std::map<std::string, std::vector<Position>> tables_;
    Session* session_ = nullptr;
    std::shared_ptr<LiveProbe> probe_;
    ProbeLayout layout_;
    std::optional<ValueDifference> difference_;
    std::uint64_t values_ = 0;
};

}  // namespace hal::tools
