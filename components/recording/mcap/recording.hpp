// SPDX-License-Identifier: MIT
// A recording as columns over time, for what plays it, draws it or compares with it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "recording/mcap/rows.hpp"

namespace hal::mcap {

/// Rows of one channel: those of one thread.
struct Table {
    std::string                topic;
    std::vector<Column>        columns;
    std::vector<std::int64_t>  times_ns;    ///< Unix time, ascending
    std::vector<std::uint64_t> words;      ///< row after row

    std::size_t   rows() const { return times_ns.size(); }
    std::uint64_t word(std::size_t row, std::size_t column) const { return words[row * columns.size() + column]; }
    double        real(std::size_t row, std::size_t column) const;
};

struct Event {
    std::int64_t time_ns;
    std::string  kind, text;
};

struct Recording {
    std::vector<Table> tables;
    std::vector<Event> events;
    std::string        note;                      ///< what is wrong with the file though it was read; "" when nothing is

    std::int64_t begin_ns() const;
    std::int64_t end_ns() const;
};

/// Options of load().
struct LoadOptions {
    std::size_t  most_bytes = std::size_t{1} << 30;
    std::int64_t begin_ns = 0, end_ns = INT64_MAX;  ///< of Unix time
};

/// Loads a recording (.mcap, or .csv as `hal record` writes it). Returns false and sets `problem`.
bool load(const std::string& path, Recording& to, std::string& problem, const LoadOptions& options = {});

}  // namespace hal::mcap
