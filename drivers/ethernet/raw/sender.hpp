// SPDX-License-Identifier: MIT
// Sends frames to the interface past its queueing discipline, so that they do not wait behind other
// traffic.
#pragma once

#include <atomic>
#include <span>
#include <string>

#include "link/ethernet.hpp"
#include "link/system.hpp"
#include "raw_clock.hpp"

namespace hal::ethernet::rawether {

class Sender {
public:
    explicit Sender(RealTime& clock) noexcept : clock_(clock) {}

    /// Opens the socket. Returns the problem, or "". [setup]
    std::string open(bool transmit_stamps);
    /// Binds it to an interface. [setup] monitor
    bool bind(int index) noexcept;

    /// Sends a frame now, unless it is late, with its stamp. Any thread; several at a time.
    /// [realtime]
    Sent leave(std::span<const std::uint8_t> frame, const Launch&) noexcept;
    /// Spins until a time. [realtime]
    ///
    /// After a pause the kernel's send path is no longer in the caches, and a frame leaves some
    /// microseconds late. So a few microseconds before the time the kernel is given a frame that it
    /// rejects at the end of most of that path: 13 bytes, less than an Ethernet header.
    void await(std::int64_t time_ns) noexcept;
    /// Counts a frame that cannot be sent for a reason other than those of leave(). [realtime]
    Sent drop(Sent why) noexcept;
    /// Clears an error that the kernel kept from when the interface was down. [setup] monitor
    void forget() noexcept;

    std::atomic<bool> up{false};  ///< written by the monitor
    std::atomic<std::uint32_t> mtu{1500};  ///< written by the monitor
    std::atomic<std::uint64_t> sent{0};
    std::atomic<std::uint64_t> sent_bytes{0};
    std::atomic<std::uint64_t> dropped{0};
    std::atomic<std::uint64_t> late{0};
    std::atomic<std::uint64_t> errors{0};
    std::atomic<std::int64_t> launch_error_ns{0};
    std::atomic<std::int64_t> departure_ns{0};

private:
    int transmit(std::span<const std::uint8_t> bytes) noexcept;
    void measure(const Launch&, std::int64_t now_ns) noexcept;
    void read_stamps() noexcept;

    RealTime& clock_;
    link::Descriptor socket_;
    std::atomic<std::int64_t> last_ns_{0};  ///< when something was sent
    bool transmit_stamps_ = false;
};

}  // namespace hal::ethernet::rawether
