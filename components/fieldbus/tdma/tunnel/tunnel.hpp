// SPDX-License-Identifier: MIT
// Ordinary packets across the segment in slot 1, with the tunnelling flag of the RTmac header
// (RTnet, Documentation/RTmac), like RTnet's virtual interface. The cycle uses one side, an
// ordinary thread (tap.hpp) the other; two queues connect them.
//
// When a queue is full, new packets are dropped, as by any interface. Packets that waited while the
// station did not send are stale and dropped too.
#pragma once

#include <atomic>

#include "fieldbus/tdma/station/station.hpp"
#include "hal/queue.hpp"

namespace hal::tdma {

/// Returns the MTU of a slot of `size` bytes: at most 1496; 0 when it is below the 68 bytes that IP
/// needs (RFC 791). [any]
constexpr std::size_t tunnel_mtu(std::size_t size) noexcept {
    constexpr std::size_t smallest = 68;

    constexpr std::size_t max = ethernet::max_frame - ethernet::header_bytes - rtmac_bytes;
    if (size < smallest + rtmac_bytes) return 0;
    if (size - rtmac_bytes < max) return size - rtmac_bytes;
    return max;
}

/// Returns the MTU of a station's slot for ordinary packets; 0: no such slot. [any]
std::size_t tunnel_mtu(const StationSetup&) noexcept;

/// Returns true for a tunnelled frame that may be passed to the IP stack of `own`: addressed to it
/// or to a group, from a single station, not of an Ethertype of the segment, and at least as long
/// as its IP or ARP header states. [any]
bool is_packet(const Decoded& frame, const Address& own) noexcept;

class Tunnel final : public Companion {
public:
    static constexpr std::size_t capacity = 64;  ///< packets in each queue

    /// `station` must outlive it; register it by Station::accompany(). [setup]
    explicit Tunnel(Station& station);

    // The cycle's side.
    void arrived(std::span<const std::uint8_t> frame, Time now) noexcept override;  ///< [realtime]
    void before_slots(Time now) noexcept override;  ///< [realtime]

    // The thread's side.
    /// Queues an Ethernet frame for slot 1. Returns false and counts it when the queue is full, the
    /// frame is too long, or the station may not send. [any] one thread
    bool give(std::span<const std::uint8_t> frame) noexcept;
    /// Copies the oldest received Ethernet frame to `out` (at least max_frame bytes) and
    /// returns its length; 0: none. [any] one thread
    std::size_t take(std::span<std::uint8_t> out) noexcept;

    /// 0: no slot 1, or too short. [any]
    std::size_t mtu() const noexcept { return mtu_.load(std::memory_order_relaxed); }
    /// packets may pass. [any]
    bool open() const noexcept { return mtu() != 0 && station_.ready(); }

    /// packets passed to slot 1. [any]
    std::uint64_t sent() const noexcept { return read(sent_); }
    /// packets for the IP stack. [any]
    std::uint64_t received() const noexcept { return read(received_); }
    /// Packets dropped in either direction: queue full, or stale. [any]
    std::uint64_t dropped() const noexcept {
        return read(dropped_out_) + read(dropped_old_) + read(dropped_in_);
    }
    /// received frames that are not packets for this station. [any]
    std::uint64_t rejected() const noexcept { return read(rejected_); }

private:
    struct Packet {
        std::size_t length = 0;
        std::array<std::uint8_t, ethernet::max_frame> bytes;
    };
    using Counter = std::atomic<std::uint64_t>;
    static std::uint64_t read(const Counter& c) noexcept {
        return c.load(std::memory_order_relaxed);
    }
    // each has one writer
    static void count(Counter& c) noexcept { c.store(read(c) + 1, std::memory_order_relaxed); }

    Station& station_;
    // thread to cycle, cycle to thread; whole RTmac frames
    hal::Queue<Packet> out_{capacity};
    hal::Queue<Packet> in_{capacity};
    std::atomic<std::size_t> mtu_{0};  // written by the cycle
    // the cycle's: when the slots were filled
    Time last_ = 0;
    // written by the cycle
    Counter sent_{0};
    Counter received_{0};
    Counter dropped_old_{0};
    Counter dropped_in_{0};
    Counter rejected_{0};
    // written by the thread
    Counter dropped_out_{0};
};

}  // namespace hal::tdma
