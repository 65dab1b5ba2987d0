// SPDX-License-Identifier: MIT
// The counters shared by all CAN drivers, and the bus load as seen from this link.
#pragma once

#include <atomic>

#include "link/can.hpp"
#include "link/timing.hpp"
#include "link/trace_frame.hpp"

namespace hal::can {

/// Reports a frame to the timeline; an extended identifier has bit 31. [realtime]
inline void trace(link::FrameKind kind, const Frame& f) noexcept {
    link::trace_frame(kind, f.extended ? f.id | 0x80000000U : f.id, f.bytes().size());
}

/// Returns whether a frame can be sent with these options. [realtime]
inline bool may_send(const Frame& frame, const Options& options) noexcept {
    return frame.valid() && !options.listen_only && (!frame.fd || options.fd);
}

/// Counters of one link. The sending thread writes `sent`, `sent_bytes`, `dropped`; the receiving
/// one the rest; both add to the load. [realtime]
class Counting {
public:
    using Count = std::atomic<std::uint64_t>;
    Count sent{0};
    Count sent_bytes{0};
    Count received{0};
    Count received_bytes{0};
    Count lost{0};
    Count dropped{0};
    Count errors{0};

    Count bus_offs{0};
    Count restarts{0};
    Count rejected{0};
    std::atomic<std::uint8_t> send_errors{0};
    std::atomic<std::uint8_t> receive_errors{0};
    std::atomic<State> state{State::active};
    std::atomic<std::uint32_t> bit_rate{0};
    std::atomic<std::uint32_t> data_rate{0};  ///< 0: unknown, and no load

    /// Adds to a counter.
    static void add(Count& to, std::uint64_t value = 1) noexcept {
        to.fetch_add(value, std::memory_order_relaxed);
    }

    /// Counts a frame that is not sent. Sending thread.
    Sent drop(Sent why) noexcept {
        add(dropped);
        return why;
    }
    /// Counts a sent frame. Sending thread.
    void count_sent(const Frame& f) noexcept {
        trace(link::can_sent, f);
        add(sent);
        add(sent_bytes, f.bytes().size());
        occupy(f);
    }
    /// Counts a received frame. Receiving thread.
    void count_received(const Frame& f) noexcept {
        trace(link::can_received, f);
        add(received);
        add(received_bytes, f.bytes().size());
        if (!f.own) {
            occupy(f);
        }
    }
    /// Closes the window of the load when it is over. Receiving thread, once per call.
    void tick(std::int64_t now_ns) noexcept {
        constexpr std::int64_t window_ns = 100'000'000;
        if (now_ns >= window_start_ && now_ns - window_start_ < window_ns) return;
        const auto busy = busy_ns_.exchange(0, std::memory_order_relaxed);
        const auto share =
            static_cast<double>(busy) /
            static_cast<double>(now_ns > window_start_ ? now_ns - window_start_ : window_ns);
        load_.store(share < 1.0 ? share : 1.0, std::memory_order_relaxed);
        window_start_ = now_ns;
    }
    /// Returns all counters; `queued` is the number of frames waiting. [any]
    Statistics read(std::size_t queued) const noexcept {
        const auto of = [](const auto& counter) { return counter.load(std::memory_order_relaxed); };
        Statistics s;
        s.state = of(state);
        s.send_errors = of(send_errors);
        s.receive_errors = of(receive_errors);
        s.sent = of(sent);
        s.sent_bytes = of(sent_bytes);
        s.received = of(received);
        s.received_bytes = of(received_bytes);
        s.lost = of(lost);
        s.dropped = of(dropped);
        s.errors = of(errors);
        s.bus_offs = of(bus_offs);
        s.restarts = of(restarts);
        s.rejected = of(rejected);
        s.queued = static_cast<std::uint32_t>(queued);
        s.load = of(load_);
        return s;
    }

private:
    void occupy(const Frame& f) noexcept {
        const auto rate = bit_rate.load(std::memory_order_relaxed);
        if (rate == 0) return;
        const auto time =
            duration_ns(frame_bits(f), rate, data_rate.load(std::memory_order_relaxed));
        busy_ns_.fetch_add(static_cast<std::uint64_t>(time), std::memory_order_relaxed);
    }
    std::int64_t window_start_ = 0;
    Count busy_ns_{0};
    std::atomic<double> load_{0.0};
};

}  // namespace hal::can
