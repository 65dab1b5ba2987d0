// SPDX-License-Identifier: MIT
// What a traced thread records: when each of its functions ran, and the frames that it sent and
// received.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>

#include "hal/queue.hpp"

namespace hal {

/// One event, as docs/protocol.md has it on the socket.
struct TraceEvent {
    enum Kind : std::uint16_t {
        function = 1,  ///< id: of the function
        cycle = 2,     ///< begin: wake-up; id: wake-up latency in ns
        plan = 3,      ///< an edit took effect: the thread took a new plan
        missed = 4,    ///< id: number of periods in which no cycle ran, before cycle_number
        can_sent = 5,  ///< id: of the frame; bit 31: extended
        can_received = 6,
        ethernet_sent = 7,  ///< id: type of the frame
        ethernet_received = 8,
    };
    std::int64_t begin_ns = 0;
    std::int64_t end_ns = 0;  ///< CLOCK_MONOTONIC
    std::uint64_t cycle_number = 0;
    std::uint32_t id = 0;
    std::uint16_t kind = 0;
    std::uint16_t bytes = 0;                ///< of a frame
};
static_assert(sizeof(TraceEvent) == 32);

/// The events of one thread. The thread writes, one reader reads; neither waits. An event that does
/// not fit is counted and dropped.
class TraceRing {
public:
    /// Allocates and touches the memory. [setup]
    TraceRing() : events_(capacity) {}
    // 2 MiB: 0.3 s of a thread with 10 functions at 20 kHz
    static constexpr std::size_t capacity = std::size_t{1} << 16;

    /// Numbers that do not fit into the event are limited. [realtime] writer
    void put(TraceEvent::Kind kind, std::int64_t begin_ns, std::int64_t end_ns, std::uint64_t cycle,
             std::uint64_t id, std::size_t bytes = 0) noexcept {
        const TraceEvent event{
            begin_ns, end_ns,
            cycle,    static_cast<std::uint32_t>(std::min<std::uint64_t>(id, UINT32_MAX)),
            kind,     static_cast<std::uint16_t>(std::min<std::size_t>(bytes, UINT16_MAX))};
        if (!events_.push(event)) {
            lost_.store(lost_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
        }
    }
    /// Removes the oldest event. Returns false when the ring is empty. [any] reader
    bool take(TraceEvent& event) noexcept { return events_.pop(event); }
    /// Returns how many events did not fit since the ring was made. [any]
    std::uint64_t lost() const noexcept { return lost_.load(std::memory_order_relaxed); }

private:
    Queue<TraceEvent> events_;
    std::atomic<std::uint64_t> lost_{0};  // written by the writer
};

}  // namespace hal

/// Records a frame in the trace of the calling thread; does nothing in a thread that is not traced.
/// For drivers/link/trace_frame.hpp. [realtime]
extern "C" [[gnu::visibility("default")]] void hal_trace_frame(unsigned kind, std::uint32_t id,
                                                               std::size_t bytes) noexcept;
