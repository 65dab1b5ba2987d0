// SPDX-License-Identifier: MIT
// Copies of a journal that end, or begin, where a re-execution has stopped.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>

namespace hal {

class JournalFile;

/// How much of a journal has been executed.
struct JournalProgress {
    std::size_t entries = 0;
    std::map<std::uint32_t, std::uint64_t> records;  ///< by number of the thread
};

/// Writes the journal `from` up to `progress` to the file `to`, without recorded values. Returns
/// why not; "" when it is written. [setup]
std::string write_shortened(const std::string& from, const std::string& to,
                            const JournalProgress& progress);

/// Writes what remains of `file`, which has been executed up to `progress`, to the file `to`,
/// without recorded values. It begins with `state`. Nothing of `file` can be executed after it.
/// Returns why not; "" when it is written. [setup]
std::string write_remaining(JournalFile& file, const std::string& to,
                            const JournalProgress& progress, std::string state);

}  // namespace hal
