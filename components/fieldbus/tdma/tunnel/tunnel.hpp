// SPDX-License-Identifier: MIT
// Ordinary packets across the segment in slot 1, behind the RTmac header with its tunnelling flag (RTnet, Documentation/RTmac): what
// RTnet's virtual interface does. The cycle has one side of it, an ordinary thread (tap.hpp) the other; they meet in two queues.
//
// What does not fit is dropped, the newest first, as any interface does it; IP and TCP live with that. Packets that waited while the
// station was silent are old and are not sent.
#pragma once

#include <atomic>

#include "fieldbus/tdma/station/station.hpp"
#include "link/ring.hpp"

namespace hal::tdma {

/// Bytes of an IP packet that a slot of `size` bytes carries: at most 1496; 0: fewer than IP needs, which are 68 (RFC 791). [any]
constexpr std::size_t tunnel_mtu(std::size_t size) noexcept {
    constexpr std::size_t smallest = 68, largest = ethernet::largest_frame - ethernet::header_bytes - rtmac_bytes;
    return size < smallest + rtmac_bytes ? 0 : size - rtmac_bytes < largest ? size - rtmac_bytes : largest;
}

/// Of a station's slot for ordinary packets; 0: it has none. [any]
std::size_t tunnel_mtu(const StationSetup&) noexcept;

/// A tunnelled frame that may be handed to the IP stack of `own`: for it or for a group, from one station, of an Ethertype that is
/// none of the segment's own, and at least as long as its IP or ARP header says. [any]
bool is_packet(const Decoded& frame, const Address& own) noexcept;

class Tunnel final : public Companion {
public:
    static constexpr std::size_t capacity = 64;  ///< packets that may wait, each way

    /// Of a station that outlives it; it is given to Station::accompany. [setup]
    explicit Tunnel(Station& station);

    // The cycle's side.
    void arrived(std::span<const std::uint8_t> frame, Time now) noexcept override;  ///< [realtime]
    void before_slots(Time now) noexcept override;                                  ///< [realtime]

    // The thread's side.
    /// An Ethernet frame for slot 1. False, and counted: no room, too long, or the station may not send. [any] one thread
    bool give(std::span<const std::uint8_t> frame) noexcept;
    /// The oldest Ethernet frame that came, in `out` of at least largest_frame bytes; its length, 0: there is none. [any] one thread
    std::size_t take(std::span<std::uint8_t> out) noexcept;

    std::size_t mtu() const noexcept { return mtu_.load(std::memory_order_relaxed); }  ///< 0: no slot 1, or too small a one. [any]
    bool        open() const noexcept { return mtu() != 0 && station_.ready(); }       ///< packets may pass. [any]

    std::uint64_t sent() const noexcept { return read(sent_); }          ///< handed to slot 1. [any]
    std::uint64_t received() const noexcept { return read(received_); }  ///< for the IP stack. [any]
    /// No room, either way, or too old. [any]
    std::uint64_t dropped() const noexcept { return read(dropped_out_) + read(dropped_old_) + read(dropped_in_); }
    std::uint64_t refused() const noexcept { return read(refused_); }    ///< came, and are no packets for this station. [any]

private:
    struct Packet {
        std::size_t                                       length = 0;
        std::array<std::uint8_t, ethernet::largest_frame> bytes;
    };
    using Counter = std::atomic<std::uint64_t>;
    static std::uint64_t read(const Counter& c) noexcept { return c.load(std::memory_order_relaxed); }
    static void          count(Counter& c) noexcept { c.store(read(c) + 1, std::memory_order_relaxed); }  // each has one writer

    Station&                 station_;
    link::Ring<Packet>        out_{capacity}, in_{capacity};  // thread to cycle, cycle to thread; whole RTmac frames
    std::atomic<std::size_t> mtu_{0};                        // written by the cycle
    Time                     last_ = 0;                      // the cycle's: when the slots were filled
    Counter                  sent_{0}, received_{0}, dropped_old_{0}, dropped_in_{0}, refused_{0};  // written by the cycle
    Counter                  dropped_out_{0};                                                       // written by the thread
};

}  // namespace hal::tdma
