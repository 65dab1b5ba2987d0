// SPDX-License-Identifier: MIT
// What a component shows of the frames that it sends. A link may drop a frame that it has queued:
// the bus goes off, or a discipline may not send. Counted by the results of send() alone, such a
// frame would be shown as sent.
#pragma once

#include <algorithm>
#include <cstdint>

#include "link/can.hpp"

namespace hal::can {

/// Counts the frames sent through one link: each is either sent (or waits), or dropped.
class SendCounter {
public:
    /// Begins with a new link; its statistics are 0, and the counts go on. [setup]
    void open() noexcept { seen_ = refused_ = 0; }
    /// Counts a frame by the result of send(). Returns true when it was queued. [realtime]
    bool count(Sent result) noexcept {
        if (result != Sent::queued) {
            ++refused_;
            return false;
        }
        ++sent_;
        return true;
    }
    /// Counts what the link has dropped since the last call; call it after flush(). [realtime]
    void update(const Statistics& link) noexcept {
        const std::uint64_t lost = std::max(link.dropped - seen_, refused_);
        const std::uint64_t discarded = std::min(lost - refused_, sent_);
        seen_ = link.dropped;
        refused_ = 0;
        sent_ -= discarded;
        dropped_ += lost;
    }
    std::uint64_t sent() const noexcept { return sent_; }  ///< sent or waiting. [realtime]
    /// Frames not queued, or discarded by the link while they waited. [realtime]
    std::uint64_t dropped() const noexcept { return dropped_; }

private:
    std::uint64_t sent_ = 0;
    std::uint64_t dropped_ = 0;
    std::uint64_t seen_ = 0;     // dropped frames in the statistics of the link
    std::uint64_t refused_ = 0;  // by send() since the last update()
};

}  // namespace hal::can
