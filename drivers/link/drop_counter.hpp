// SPDX-License-Identifier: MIT
// Counts the frames that the kernel dropped because the receive queue of a socket was full.
#pragma once

#include <linux/sock_diag.h>
#include <sys/socket.h>

#include <array>
#include <cstdint>

namespace hal::link {

/// Reads the kernel's counter (SO_MEMINFO) while a backlog is received: a queue that was full is
/// one. The counter that frames carry (SO_RXQ_OVFL) is that of the time when each was queued, so
/// the drops behind the last queued frame would be unknown until another frame arrives. Used by the
/// receiving thread.
class DropCounter {
public:
    /// Call after each receive call. `frames`: how many it returned; `drained`: the queue was empty
    /// then. Returns the frames dropped since the last result other than 0. [realtime]
    std::uint64_t update(int socket, std::size_t frames, bool drained) noexcept {
        backlog_ += frames;
        const bool looks = backlog_ >= min_backlog;
        if (looks || drained) {
            backlog_ = 0;
        }
        const bool ends = drained && was_backlog_;
        was_backlog_ = looks || (was_backlog_ && !drained);
        return looks || ends ? read(socket) : 0;
    }

private:
    static constexpr std::size_t min_backlog = 16;

    std::uint64_t read(int socket) noexcept {
        std::array<std::uint32_t, SK_MEMINFO_VARS> memory{};
        socklen_t size = sizeof memory;
        if (getsockopt(socket, SOL_SOCKET, SO_MEMINFO, memory.data(), &size) != 0) return 0;
        const std::uint32_t total = memory[SK_MEMINFO_DROPS];
        std::uint32_t fresh = total - total_;
        if (fresh > UINT32_MAX / 2) {
            fresh = total;  // another socket has the descriptor
        }
        total_ = total;
        return fresh;
    }

    std::size_t backlog_ = 0;
    std::uint32_t total_ = 0;
    bool was_backlog_ = false;
};

}  // namespace hal::link
