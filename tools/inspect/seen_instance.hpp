// SPDX-License-Identifier: MIT
// The data of `hal top` about an instance, and its display.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace hal::tools {

struct SeenThread {
    std::string name;
    std::int64_t period_ns = 0;
    std::uint64_t cycles = 0;
    std::uint64_t missed = 0;
    bool faulted = false;
};

/// One instance, as in its status (hal/status.h): from its control socket, or from the network.
struct SeenInstance {
    std::string instance, host, cell, node;
    std::int64_t pid = 0;
    bool running = false;
    std::vector<SeenThread> threads;
    std::uint64_t faults = 0;
    std::string fault;              ///< the newest, a sentence
    double silent_s = 0;            ///< since its last status

    bool same(const SeenInstance& other) const {
        return pid == other.pid && instance == other.instance && host == other.host;
    }
};

/// Parses a status text. Returns false when it is invalid.
bool read_status(std::string_view text, SeenInstance& seen);

/// Returns the lines of a table, in the given order. Columns without information are left out, and
/// columns are narrower, if it is wider than `columns`.
std::vector<std::string> top_lines(const std::vector<SeenInstance>& all, std::size_t columns);
/// Returns the whole table as a text.
std::string top_table(const std::vector<SeenInstance>& all);
/// Returns an array of JSON objects, one line.
std::string top_json(const std::vector<SeenInstance>& all);

}  // namespace hal::tools
