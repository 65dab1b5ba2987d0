// SPDX-License-Identifier: MIT
// A recording as columns over time, for what plays it, draws it or compares with it.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "recording/mcap/rows.hpp"

namespace hal::mcap {

/// Returns the type of "bit", "float" or "s32", "u32", "s64", "u64".
std::optional<hal_type> type_of_word(std::string_view word);
/// Returns its inverse; "" for other types.
std::string_view word_of_type(hal_type type);

/// Rows of one channel: those of one thread.
struct Table {
    std::string topic;
    std::vector<Column> columns;
    std::vector<std::int64_t> times_ns;    ///< Unix time, ascending
    std::vector<std::uint64_t> words;      ///< row after row
    std::string thread = {};  ///< of a machine; "" of another writer

    std::size_t rows() const { return times_ns.size(); }
    std::uint64_t word(std::size_t row, std::size_t column) const {
        return words[row * columns.size() + column];
    }
    double real(std::size_t row, std::size_t column) const;
};

struct Event {
    std::int64_t time_ns;
    std::string kind, text;
};

struct Recording {
    std::vector<Table> tables;
    std::vector<Event> events;
    /// of a file that was cut off or damaged: which rows of which values are missing; else ""
    std::string missing;
    /// what else is wrong with the file though it was read; "" when nothing is
    std::string note;
    /// of a file without rows: the reason, such as which of its topics is not read, and why; else
    /// ""
    std::string unread;
    /// of a file with rows: what of it is not read, a sentence per topic
    std::vector<std::string> skipped = {};

    std::int64_t begin_ns() const;
    std::int64_t end_ns() const;
    /// Returns the sentences for the user of the file: `missing`, `note` and `skipped`.
    std::vector<std::string> notes() const;
};

/// Options of load().
struct LoadOptions {
    std::uint64_t max_bytes = std::uint64_t{1} << 30;
    /// of Unix time; of the table's time for .csv
    std::int64_t begin_ns = INT64_MIN;
    std::int64_t end_ns = INT64_MAX;
    /// of columns of a .csv, which does not have them; others are FLOAT
    std::map<std::string, hal_type> types = {};
    /// what `problem` advises for a file with more than `max_bytes` of values
    std::string too_large_help = "choose a part of it";
};

/// Loads a recording (.mcap, or .csv as `hal record` writes it). Returns false and sets `problem`.
bool load(const std::string& path, Recording& to, std::string& problem,
          const LoadOptions& options = {});

}  // namespace hal::mcap
