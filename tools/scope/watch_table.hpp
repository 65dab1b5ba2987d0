// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "scope/samples.hpp"

namespace hal::tools {

/// Values with their extremes and rates, over all samples since the last reset.
class WatchTable {
public:
    explicit WatchTable(std::vector<Channel> channels)
        : channels_(std::move(channels)), rows_(channels_.size()) {}

    void feed(std::size_t channel, Sample sample);
    /// Forgets minimum and maximum.
    void reset();
    bool has_value(std::size_t channel) const { return rows_[channel].any; }
    struct Texts {
        /// rate: change per second over the last second, of a bit: edges; with its unit
        std::string value, min, max, rate;
    };
    /// Returns what lines() has of a channel; "-" without a sample.
    Texts texts(std::size_t channel) const;
    /// Returns a head and a line per channel: name, value, unit, minimum, maximum, change per
    /// second over the last second (of a bit: edges). What does not fit into `columns` is left out
    /// from the right; a long name loses its beginning.
    std::vector<std::string> lines(std::size_t columns = SIZE_MAX) const;

private:
    struct Row {
        bool any = false;
        Sample last;
        Sample min, max;
        std::uint64_t edges = 0;
        struct Mark {
            Sample sample;
            std::uint64_t edges;
        };
        std::deque<Mark> marks;  ///< each 100 ms, of the last second
    };
    std::vector<Channel> channels_;
    std::vector<Row> rows_;
};

}  // namespace hal::tools
