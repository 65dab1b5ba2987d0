// SPDX-License-Identifier: MIT
// The table of `hal top`: a row for each thread.
#include <algorithm>
#include <array>
#include <cstdint>
#include <fmt/core.h>

#include "base/types.hpp"
#include "inspect/seen_instance.hpp"

namespace hal::tools {

namespace {

constexpr double silent_after_s = 2;
constexpr std::size_t column_count = 8;
using Cells = std::array<std::string, column_count>;

/// A column of the table. `width` is the usual one.
struct Column {
    const char* head;
    std::size_t width;
    bool is_number;
};
constexpr std::array<Column, column_count> all_columns{{{"INSTANCE", 16, false},
                                                        {"HOST", 12, false},
                                                        {"NODE", 20, false},
                                                        {"THREAD", 14, false},
                                                        {"PERIOD", 9, true},
                                                        {"CYCLES", 12, true},
                                                        {"MISSED", 8, true},
                                                        {"FAULTS", 6, true}}};
constexpr std::size_t host_column = 1;
constexpr std::size_t node_column = 2;

struct Row {
    Cells cells;
    std::string state;  // behind the columns
    std::string fault;  // of the instance, on a line of its own
};

std::string state_text(const SeenInstance& one) {
    if (one.silent_s > silent_after_s) return fmt::format("  offline for {:.0f} s", one.silent_s);
    return one.running ? "" : "  stopped";
}

Cells instance_cells(const SeenInstance& one) {
    return {one.instance,
            one.host,
            one.node.empty() ? "" : one.cell + "/" + one.node,
            "-",
            "-",
            "0",
            "0",
            std::to_string(one.faults)};
}

/// An instance without threads has a row, too.
std::vector<Row> rows_of(const SeenInstance& one) {
    std::vector<Row> rows;
    for (const SeenThread& thread : one.threads) {
        Cells cells = rows.empty() ? instance_cells(one) : Cells{};  // it is named once
        cells[3] = thread.name;
        cells[4] =
            thread.period_ns == 0 ? "-" : format_duration(static_cast<double>(thread.period_ns));
        cells[5] = std::to_string(thread.cycles);
        cells[6] = std::to_string(thread.missed);
        rows.push_back({cells, thread.faulted ? "  stopped by a fault" : "", ""});
    }
    if (rows.empty()) {
        rows.push_back({instance_cells(one), "", ""});
    }
    rows.front().state += state_text(one);
    rows.back().fault = one.fault;
    return rows;
}

std::vector<Row> rows_of(const std::vector<SeenInstance>& all) {
    std::vector<Row> rows;
    for (const SeenInstance& one : all) {
        for (Row& row : rows_of(one)) {
            rows.push_back(std::move(row));
        }
    }
    return rows;
}

using Widths = std::array<std::size_t, column_count>;  // 0: the column is left out

std::size_t sum_of(const Widths& widths) {
    std::size_t sum = 0;
    for (const std::size_t width : widths) {
        sum += width == 0 ? 0 : width + 1;
    }
    return sum;
}

/// Leaves out what is the same in all rows, then makes columns as narrow as their texts, until the
/// table fits into `columns`.
Widths widths_in(const std::vector<Row>& rows, std::size_t columns) {
    Widths widths{};
    for (std::size_t i = 0; i < column_count; ++i) {
        widths[i] = all_columns[i].width;
    }
    for (const std::size_t left_out : {node_column, host_column}) {
        const bool tells = std::any_of(rows.begin(), rows.end(), [&](const Row& row) {
            const std::string& text = row.cells[left_out];
            return !text.empty() && text != rows.front().cells[left_out];
        });
        const bool is_empty = rows.front().cells[left_out].empty();
        const bool is_needed = tells || (left_out == node_column && !is_empty);
        if (sum_of(widths) > columns && !is_needed) {
            widths[left_out] = 0;
        }
    }
    for (std::size_t i = 0; i < column_count && sum_of(widths) > columns; ++i) {
        if (widths[i] == 0) continue;
        widths[i] = std::string_view(all_columns[i].head).size();
        for (const Row& row : rows) {
            widths[i] = std::max(widths[i], row.cells[i].size());
        }
    }
    return widths;
}

std::string line_of(const Cells& cells, const Widths& widths) {
    std::string line;
    for (std::size_t i = 0; i < column_count; ++i) {
        if (widths[i] == 0) continue;
        const std::string& text = cells[i];
        line += line.empty() ? "" : " ";
        line += all_columns[i].is_number ? fmt::format("{:>{}}", text, widths[i])
                                         : fmt::format("{:<{}}", text, widths[i]);
    }
    return line;
}

}  // namespace

std::vector<std::string> top_lines(const std::vector<SeenInstance>& all, std::size_t columns) {
    if (all.empty()) return {"no instance is running; start one: hal run FILE.hal"};
    const std::vector<Row> rows = rows_of(all);
    const Widths widths = widths_in(rows, columns);
    Cells heads;
    for (std::size_t i = 0; i < column_count; ++i) {
        heads[i] = all_columns[i].head;
    }
    std::vector<std::string> lines{line_of(heads, widths)};
    for (const Row& row : rows) {
        lines.push_back(line_of(row.cells, widths) + row.state);
        if (!row.fault.empty()) {
            lines.push_back(fmt::format("{:<{}} newest fault: {}", "", widths[0], row.fault));
        }
    }
    return lines;
}

std::string top_table(const std::vector<SeenInstance>& all) {
    std::string text;
    for (const std::string& line : top_lines(all, SIZE_MAX)) {
        text += line + "\n";
    }
    return text;
}

}  // namespace hal::tools
