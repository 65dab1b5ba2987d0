// SPDX-License-Identifier: MIT
// A copy of a journal that ends where a re-execution has stopped.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>

namespace hal {

/// How much of a journal has been executed.
struct JournalProgress {
    std::size_t entries = 0;
    std::map<std::uint32_t, std::uint64_t> records;  ///< by number of the thread
};

/// Writes the journal `from` up to `progress` to the file `to`, without recorded values. Returns
/// why not; "" when it is written. [setup]
std::string write_shortened(const std::string& from, const std::string& to,
                            const JournalProgress& progress);

}  // namespace hal
