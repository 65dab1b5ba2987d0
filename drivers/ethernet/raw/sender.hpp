// SPDX-License-Identifier: MIT
// Frames to the interface, past its queueing discipline, so that nothing of ours waits behind something else.
#pragma once

#include <atomic>
#include <string>

#include "link/ethernet.hpp"
#include "link/system.hpp"
#include "raw_clock.hpp"

namespace hal::ethernet::rawether {

class Sender {
public:
    explicit Sender(RealTime& clock) noexcept : clock_(clock) {}

    /// What is wrong, or nothing. [setup]
    std::string open(bool transmit_stamps);
    /// [setup] monitor
    bool bind(int index) noexcept;

    /// The frame leaves now, if it is not late; stamped, if it wants to be. Any thread; several at a time. [realtime]
    Sent leave(std::span<const std::uint8_t> frame, const Launch&) noexcept;
    /// Looks at the clock until then. [realtime]
    ///
    /// After a pause what the kernel needs to send is no longer in the caches, and a frame leaves some microseconds late, more or less. So a few
    /// microseconds before its time the kernel is given what it refuses behind most of that way: 13 bytes, less than an Ethernet header.
    void await(std::int64_t time_ns) noexcept;
    /// A frame that this cannot send for another reason than those leave() finds. [realtime]
    Sent drop(Sent why) noexcept;
    /// Forgets an error that the kernel kept from when the interface was down. [setup] monitor
    void forget() noexcept;

    std::atomic<bool> up{false};            ///< written by the monitor
    std::atomic<std::uint32_t> mtu{1500};   ///< written by the monitor
    std::atomic<std::uint64_t> sent{0}, sent_bytes{0}, dropped{0}, late{0}, errors{0};
    std::atomic<std::int64_t> launch_error_ns{0}, departure_ns{0};

private:
    void read_stamps() noexcept;

    RealTime& clock_;
    link::Descriptor socket_;
    std::atomic<std::int64_t> last_ns_{0};  ///< when something was sent
    bool transmit_stamps_ = false;
};

}  // namespace hal::ethernet::rawether
