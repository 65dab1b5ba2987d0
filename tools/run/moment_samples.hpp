// SPDX-License-Identifier: MIT
// Rows of values while cycles of a journal are executed, as pages of the panel draw them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "journal/re_execution.hpp"
#include "machine/session.hpp"

namespace hal::tools {

/// A value has a row for each cycle of the thread that writes or reads it; one without a thread, for
/// each cycle of the fastest thread. Its rows begin when it is loaded. [setup] with the session's lock held
class MomentSamples {
public:
    static constexpr std::size_t max_names = 100;
    static constexpr std::size_t max_words = std::size_t{1} << 21;  ///< of all rows

    /// `names`: separated by blanks.
    MomentSamples(Session& session, const std::string& names, const std::string& fastest);

    /// Returns why there are no rows for these names; "" when there are.
    const std::string& problem() const { return problem_; }
    /// Adds a row to the values of the thread of the cycle that was executed last.
    void add(const JournaledCycle& cycle);
    /// Returns members of a reply of the control protocol and an event, each a JSON object on a
    /// line, and the rows behind them (docs/protocol.md). `until_ns`: time of the newest cycle.
    std::string answer(std::int64_t until_ns) const;

private:
    struct Column {
        std::string name;
        hal_type type = HAL_TYPE_FLOAT;
        std::string unit;
        bool is_grouped = false;  // the machine has had it
    };
    struct Group {
        std::string thread;
        std::int64_t period_ns = 0;
        std::vector<std::size_t> columns;
        std::vector<std::string> names;
        std::vector<std::uint64_t> words;  // rows: cycle, time, values
        std::size_t width() const { return 2 + columns.size(); }
    };
    void group_columns();
    void group_column(std::size_t index);
    Group& group_of(const std::string& thread);
    void add_row(Group& group, const JournaledCycle& cycle);
    void drop_oldest();

    Session& session_;
    const std::string fastest_;
    std::string problem_;
    std::vector<Column> columns_;
    std::size_t grouped_ = 0;  // of columns_
    std::vector<Group> groups_;
    std::size_t words_ = 0;
    std::uint64_t left_out_ = 0;  // rows
};

}  // namespace hal::tools
