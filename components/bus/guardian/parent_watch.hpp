// SPDX-License-Identifier: MIT
#pragma once

#include <time.h>

#include <cstdint>
#include <utility>

#include "bus/guardian/heartbeat.hpp"
#include "link/system.hpp"

namespace hal::bus {

/// Watches the process of a machine from its guardian: its end (pidfd), cycles that are missing
/// (heartbeat), and a computer that was suspended. Only the heartbeat sees a process that hangs.
class ParentWatch {
public:
    enum class Change : std::uint8_t {
        none,
        died,   ///< the process has ended
        hangs,  ///< no cycle for longer than the limit, or the computer was suspended
    };

    /// `parent`: empty when the process has ended already, which the first look() finds.
    explicit ParentWatch(link::Descriptor parent)
        : parent_(std::move(parent)), suspended_ns_(suspended_ns()) {}

    /// Returns what has begun since the last call. `has_outputs`: cycles have set outputs, so that
    /// missing ones matter.
    Change look(std::uint64_t cycles, std::int64_t limit_ns, bool has_outputs,
                std::int64_t now_ns) noexcept {
        const bool hung_before = hangs_;
        const std::int64_t suspended = suspended_ns();
        const bool resumed = suspended - suspended_ns_ > 100'000'000;
        suspended_ns_ = suspended;
        const bool is_missing = heartbeat_.is_missing(cycles, limit_ns, now_ns);
        hangs_ = has_outputs && (is_missing || resumed);
        if (is_dead_) return Change::none;
        is_dead_ = !parent_ || link::readable_within(parent_.get(), 0);
        if (is_dead_) return Change::died;
        return hangs_ && !hung_before ? Change::hangs : Change::none;
    }
    bool is_dead() const noexcept { return is_dead_; }
    bool hangs() const noexcept { return hangs_; }
    /// Returns a descriptor that polls readable when the process ends; -1 behind its end.
    int descriptor() const noexcept { return is_dead_ ? -1 : parent_.get(); }

private:
    /// Time during which the system was suspended: devices go on meanwhile.
    static std::int64_t suspended_ns() noexcept {
        return link::clock_ns(CLOCK_BOOTTIME) - link::clock_ns(CLOCK_MONOTONIC);
    }

    link::Descriptor parent_;
    Heartbeat heartbeat_;
    std::int64_t suspended_ns_;
    bool is_dead_ = false;
    bool hangs_ = false;
};

}  // namespace hal::bus
