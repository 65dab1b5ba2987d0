// SPDX-License-Identifier: MIT
// What a traced thread records: when each of its functions ran. Nothing while it is not traced.
#pragma once

#include <atomic>
#include <cstdint>

#include "hal/queue.hpp"

namespace hal {

/// One event, as docs/protocol.md has it on the socket.
struct TraceEvent {
    enum Kind : std::uint32_t {
        function = 1,  ///< id: of the function
        cycle = 2,     ///< begin: wake-up; id: wake-up latency in ns
        plan = 3,      ///< an edit took effect: the thread took a new plan
        missed = 4,    ///< id: number of periods in which no cycle ran, before cycle_number
    };
    std::int64_t begin_ns = 0, end_ns = 0;  ///< CLOCK_MONOTONIC
    std::uint64_t cycle_number = 0;
    std::uint32_t id = 0;
    std::uint32_t kind = 0;
};
static_assert(sizeof(TraceEvent) == 32);

/// The events of one thread. The thread writes, one reader reads; neither waits. An event that does not fit is counted and dropped.
class TraceRing {
public:
    /// Allocates and touches the memory. [setup]
    TraceRing() : events_(capacity) {}
    static constexpr std::size_t capacity = std::size_t{1} << 16;  // 2 MiB: 0.3 s of a thread with 10 functions at 20 kHz

    /// [realtime] writer
    void put(std::int64_t begin_ns, std::int64_t end_ns, std::uint64_t cycle, std::uint32_t id, TraceEvent::Kind kind) noexcept {
        if (!events_.push({begin_ns, end_ns, cycle, id, kind})) lost_.store(lost_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
    }
    /// Removes the oldest event. Returns false when there is none. [any] reader
    bool take(TraceEvent& event) noexcept { return events_.pop(event); }
    /// Returns how many events did not fit since the ring was made. [any]
    std::uint64_t lost() const noexcept { return lost_.load(std::memory_order_relaxed); }

private:
    Queue<TraceEvent> events_;
    std::atomic<std::uint64_t> lost_{0};  // written by the writer
};

}  // namespace hal
