// SPDX-License-Identifier: MIT
// The distributed clock unit of an emulated controller (registers 0900h-09FFh): receive times,
// system time, control loop, SYNC, latch.
#pragma once

#include <array>
#include <cstdint>

#include "ethercat/esc/clock.hpp"
#include "ethercat/esc/pdi.hpp"

namespace hal::ethercat::esc {

/// [realtime]
class DistributedClock {
public:
    /// `memory` is the controller's. Does nothing if `present` is false; `wide`: 64 bits.
    void connect(std::uint8_t* memory, bool present, bool wide) noexcept {
        memory_ = memory;
        present_ = present;
        wide_ = wide;
    }
    void reset(std::int64_t now_ns, std::int64_t local_ns) noexcept;

    Clock& clock() noexcept { return clock_; }
    /// Takes a change of the clock or of 0920h: pulses are found again.
    void clock_changed(std::int64_t now_ns) noexcept;

    /// Notes the arrival of frame `number` at a port; it becomes the receive time if the frame
    /// latches, before or after.
    void arrive(unsigned port, std::int64_t now_ns, std::uint64_t number) noexcept;
    /// Latches the receive times of frame `number` (write to 0900h); the unit processed it at
    /// `unit_ns`.
    void latch_receive_times(std::int64_t unit_ns, std::uint64_t number) noexcept;

    /// Returns the local copy of system time: local time + 0920h.
    std::int64_t system_time(std::int64_t now_ns) const noexcept;
    /// Puts the system time at 0910h, as the master reads it.
    void show_system_time(std::int64_t now_ns) noexcept;
    /// Works one step of the control loop: a system time was written to 0910h (`bytes` 4 or 8).
    void receive_system_time(std::uint64_t received, std::size_t bytes,
                             std::int64_t now_ns) noexcept;
    /// Clears the filters (write to 0930h-0935h).
    void clear_filters(std::int64_t now_ns) noexcept;

    /// Takes a write to 0981h: starts or stops SYNC0 and SYNC1.
    void activate(std::int64_t now_ns) noexcept;
    /// Returns the time of the next pulse; INT64_MAX: none.
    std::int64_t next_pulse_ns() const noexcept { return next_ns_; }
    /// Generates the pulse that is due. Returns the AL event bits (0220h) that it sets.
    std::uint32_t pulse() noexcept;
    const Pdi::Sync& sync() const noexcept { return sync_; }

    /// Latches an edge of input 0 or 1.
    void latch(unsigned input, bool rising, std::int64_t now_ns) noexcept;
    /// Clears what the master's read of `length` bytes at `address` acknowledges: latch events,
    /// SYNC status.
    void was_read(std::uint16_t address, std::size_t length) noexcept;

private:
    void find_next() noexcept;

    std::uint8_t* memory_ = nullptr;
    bool present_ = false;
    bool wide_ = true;
    Clock clock_;
    struct Seen {
        std::uint64_t number = 0;
        std::int64_t time_ns = 0;
    };
    std::array<Seen, 4> seen_;
    std::uint64_t latched_frame_ = 0;

    std::int64_t last_step_ns_ = INT64_MIN;  ///< local time of the last step of the control loop
    double filtered_ = 0;
    double speed_ = 0;

    Pdi::Sync sync_;
    bool sync0_on_ = false;
    bool sync1_on_ = false;
    std::int64_t sync0_dc_ = INT64_MAX;
    std::int64_t sync1_dc_ = INT64_MAX;  ///< system time of the next pulses
    std::int64_t next_ns_ = INT64_MAX;
};

}  // namespace hal::ethercat::esc
