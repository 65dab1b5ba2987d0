// SPDX-License-Identifier: MIT
// Reads the language of the table of lcec's devices; docs/internals/lcec-devices.md has its
// grammar. Everything here is [setup].
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "ethercat/config/lcec_devices.hpp"

namespace hal::ethercat::config {

using TableWords = std::vector<std::string>;

/// A line of a device, once for each repetition.
struct TableLine {
    TableWords conditions;  ///< OPTION=VALUE; the line applies if all of them hold
    TableWords words;       ///< the keyword, then its arguments
    unsigned step = 0;      ///< number of the repetition, from 0
};

/// The shapes and the devices of a table.
class LcecTable {
public:
    /// Throws std::logic_error for an unknown name of values: tables are part of the program.
    explicit LcecTable(std::string_view text);

    const std::vector<LcecDevice>& devices() const { return devices_; }
    const TableWords& unsupported() const { return unsupported_; }
    /// Returns the lines of the shape of a device, with those of the shapes that it is like. Throws
    /// std::logic_error for an unknown shape.
    std::vector<TableLine> lines_of(const LcecDevice&) const;

private:
    struct Section {
        std::string shape;
        std::uint32_t vendor = 0;
        bool has_devices = false;
    };
    void read(const TableWords& words);
    void read_row(const TableWords& words);
    TableWords with_values(const TableWords& words) const;
    const TableWords& values(const std::string& name) const;
    void add_lines(const LcecDevice&, const std::string& shape, const std::string& text,
                   const TableLine& parent, std::vector<TableLine>& to) const;

    std::map<std::string, TableWords> values_;
    std::map<std::string, std::vector<TableWords>> shapes_;
    std::vector<LcecDevice> devices_;
    TableWords unsupported_;
    Section section_;  // that is being read
};

/// Splits a text; no part is empty.
TableWords split(std::string_view text, char separator);
/// Returns the value of hexadecimal digits; 0 for other text.
std::uint32_t hexadecimal(const std::string& text);
/// Returns a number of repetitions: `8`, or `N` or `M`, which are the device's.
unsigned count_of(const LcecDevice&, const std::string& text);
/// Replaces `##` with the number of a step from 1, `#+8` with that from 8, and `#` with that from 0.
std::string with_step(const std::string& text, unsigned step);

}  // namespace hal::ethercat::config
