// SPDX-License-Identifier: MIT
// The progress of a long transfer, as one line on the terminal.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace hal::tools {

/// Returns "12.3 of 51.2 kB, 24 %, 9 s left". `total` 0: unknown.
std::string progress_text(std::size_t done, std::size_t total, std::int64_t elapsed_ns);

/// Shows a transfer on stderr when that is a terminal: from half a second on, five times a second.
/// The line is removed at the end.
class TransferProgress {
public:
    explicit TransferProgress(std::string what);
    ~TransferProgress();
    TransferProgress(const TransferProgress&) = delete;

    void update(std::size_t done, std::size_t total);

private:
    std::string what_;
    bool terminal_ = false;
    bool shown_ = false;
    std::int64_t began_ns_ = 0;
    std::int64_t next_ns_ = 0;
};

}  // namespace hal::tools
