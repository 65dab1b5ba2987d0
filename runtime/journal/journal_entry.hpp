// SPDX-License-Identifier: MIT
// What happened to a journaled machine besides its cycles, in order.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace hal {

/// A file that code of the machine was loaded from.
struct JournaledFile {
    std::string component;
    std::string path;
    std::string hash;  ///< of file_hash()
};

/// One entry; which members are used depends on the kind.
struct ExecutionEntry {
    enum class Kind {
        /// a transaction took effect: epoch, commands, calls, files
        edit,
        /// a transaction was rolled back after threads had taken it: epoch, commands, calls
        withdrawn,
        /// a transaction was rejected or rolled back that had used buses in memory: epoch,
        /// commands, calls, starts
        rejected,
        written,  ///< programs wrote pins: values
        start,  ///< functions were started
        stop,
        /// an instance depends on the outside: instance, component, resources, threads, helpers,
        /// links, streams
        opened,
        sampled,  ///< the values of these names are recorded from here on: names
        end,  ///< the machine ended in order
    };
    Kind kind = Kind::end;
    std::uint64_t epoch = 0;
    std::vector<std::vector<std::string>> commands = {};
    std::vector<JournaledFile> files = {};
    std::vector<std::pair<std::string, std::uint64_t>> values = {};
    std::string instance = {};
    std::string component = {};
    std::vector<std::string> resources = {};
    std::uint64_t threads = 0;
    std::uint64_t helpers = 0;
    std::uint64_t links = 0;
    std::uint64_t streams = 0;
    std::vector<std::string> names = {};
    bool starts = false;  ///< its instances had been started
    std::vector<std::uint64_t> calls = {};  ///< tickets of its calls on buses in memory
};

/// Returns an entry as a line of JSON. [setup]
std::string to_json(const ExecutionEntry& entry);
/// Returns the entry of such a line; nothing when it is damaged or of a later version. [setup]
std::optional<ExecutionEntry> execution_entry(std::string_view json);

}  // namespace hal
