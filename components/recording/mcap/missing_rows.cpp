// SPDX-License-Identifier: MIT
#include "recording/mcap/missing_rows.hpp"

#include <algorithm>
#include <cstdio>

#include "text/quoting.hpp"

namespace hal::mcap {
namespace {

/// Returns "0.25 s" for a time since the first row.
std::string seconds(std::int64_t ns) {
    char text[40];
    std::snprintf(text, sizeof text, "%.9g s", static_cast<double>(ns) * 1e-9);
    return text;
}

std::vector<std::string> names_of(const Table& table) {
    std::vector<std::string> names;
    for (const Column& column : table.columns) {
        names.push_back(column.name);
    }
    return names;
}

/// Returns ", of '/hal/servo' (x, y)": the tables of a recording.
std::string of_tables(const Recording& recording) {
    std::vector<std::string> tables;
    for (const Table& table : recording.tables) {
        const std::string values = listed(names_of(table));
        tables.push_back(
            table.topic.empty() ? values : "'" + table.topic.substr(0, 60) + "' (" + values + ")");
    }
    return tables.empty() ? "" : ", of " + listed(tables);
}

/// Returns "from 0.25 s to 0.5 s": the times of a chunk, counted from the first row that was read.
std::string span_of(const ChunkIndex& chunk, std::int64_t first_row_ns) {
    const std::int64_t begin = static_cast<std::int64_t>(chunk.begin_time) - first_row_ns;
    const std::int64_t end = static_cast<std::int64_t>(chunk.end_time) - first_row_ns;
    if (end < 0) return "before the first readable row";
    return (begin < 0 ? "up to " : "from " + seconds(begin) + " to ") + seconds(end);
}

bool has_rows(const Recording& recording) {
    return std::any_of(recording.tables.begin(), recording.tables.end(),
                       [](const Table& table) { return table.rows() != 0; });
}

}  // namespace

std::string listed(const std::vector<std::string>& fields) {
    constexpr std::size_t max_fields = 4;
    std::string text;
    for (std::size_t i = 0; i < fields.size() && i < max_fields; ++i) {
        text += (i == 0 ? "" : ", ") + fields[i];
    }
    if (fields.size() > max_fields) {
        text += " and " + std::to_string(fields.size() - max_fields) + " more";
    }
    return text;
}

std::string missing_rows(const Recording& recording) {
    const std::string end = seconds(recording.end_ns() - recording.begin_ns());
    const std::string rows = has_rows(recording) ? "rows after " + end : "all rows";
    return rows + " are missing" + of_tables(recording);
}

std::string missing_rows(const Recording& recording, const std::vector<ChunkIndex>& damaged) {
    if (!has_rows(recording)) return missing_rows(recording);
    constexpr std::size_t max_named = 3;
    std::vector<std::string> spans;
    for (std::size_t i = 0; i < damaged.size() && i < max_named; ++i) {
        spans.push_back(span_of(damaged[i], recording.begin_ns()));
    }
    if (damaged.size() > max_named) {
        spans.push_back("in " + counted(damaged.size() - max_named, "further chunk"));
    }
    return "rows " + listed(spans) + " are missing" + of_tables(recording);
}

}  // namespace hal::mcap
