// SPDX-License-Identifier: MIT
// The two modes with a handshake between master and drive: set-points of profile position, and
// homing.
#pragma once

#include <array>

#include "axis_failure.hpp"

namespace hal::cia402 {

/// A set-point of profile position.
struct SetPoint {
    std::int32_t target = 0;
    bool relative = false;   ///< to the previous set-point
    bool immediate = false;  ///< replaces the current move; otherwise it follows after it
    bool blend = false;      ///< the drive does not stop in between (change on set-point)
};

/// Profile position: passes set-points to the drive one by one, as fast as it takes them.
class SetPoints {
public:
    static constexpr std::size_t capacity = 16;

    /// Queues a set-point; an immediate one replaces all queued ones, a relative one by their sum.
    /// Returns false when the queue is full, or the sum out of range. [realtime]
    bool push(const SetPoint&) noexcept;
    /// Discards the set-points that are not reached yet: done() is false until a later one is.
    /// [realtime]
    void clear() noexcept {
        discarded_ = discarded_ || !done_;
        count_ = 0;
        phase_ = Phase::idle;
        failure_ = {};
    }
    /// Runs one cycle. Returns bits 4, 5, 6 and 9 of the controlword and sets the target that
    /// belongs to them. `limit`: timeout of an acknowledge, ns. [realtime]
    std::uint16_t step(std::uint16_t statusword, Time now, Time limit,
                       std::int32_t& target) noexcept;
    std::size_t waiting() const noexcept { return count_; }
    /// Returns true when all set-points are passed to the drive and it has reached the last.
    /// [realtime]
    bool done() const noexcept { return done_ && !discarded_; }
    /// Returns true after clear() discarded a set-point, until the next push(). [realtime]
    bool discarded() const noexcept { return discarded_; }
    /// Returns the failure of the handshake; cleared by clear().
    const Failure& failure() const noexcept { return failure_; }

private:
    enum class Phase : std::uint8_t { idle, shown, raised, settling };
    void enter(Phase phase, Time now) noexcept {
        phase_ = phase;
        since_ = now;
        cycles_ = 0;
    }
    void check(std::uint16_t statusword, Time now, Time limit) noexcept;
    bool combine(SetPoint&) const noexcept;

    std::array<SetPoint, capacity> queue_{};
    std::size_t first_ = 0;
    std::size_t count_ = 0;
    SetPoint now_;
    Phase phase_ = Phase::idle;
    Time since_ = 0;
    unsigned cycles_ = 0;
    bool done_ = true;
    bool discarded_ = false;
    Failure failure_;
};

/// Homing: starts it, and distinguishes a stale "attained" or "error" from the result of this run.
class HomingRun {
public:
    enum class Result : std::uint8_t { running, attained, failed };
    void begin() noexcept {
        phase_ = Phase::fresh;
        failure_ = {};
    }
    /// Runs one cycle in mode hm; bit 4 of the controlword must be set meanwhile. `settle`: how
    /// long a stale result may persist; `limit`: timeout of the whole run, 0 for none, both in ns.
    /// A halt stops the clock. [realtime]
    Result step(std::uint16_t statusword, bool halted, Time now, Time settle, Time limit) noexcept;
    const Failure& failure() const noexcept { return failure_; }

private:
    enum class Phase : std::uint8_t { fresh, old_result, running };
    Result fail(Cause, std::uint16_t statusword, Time waited) noexcept;

    Phase phase_ = Phase::fresh;
    Time since_ = 0;
    Time last_ = 0;
    bool error_seen_ = false;
    Failure failure_;
};

}  // namespace hal::cia402
