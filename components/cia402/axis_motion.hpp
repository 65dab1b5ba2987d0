// SPDX-License-Identifier: MIT
// The two modes in which master and drive shake hands by bits: set-points of profile position, and homing.
#pragma once

#include <array>

#include "axis_failure.hpp"

namespace hal::canopen::cia402 {

struct SetPoint {
    std::int32_t target = 0;
    bool relative = false;   ///< to the last set-point
    bool immediate = false;  ///< in place of what the drive does now; else it is done after that
    bool blend = false;      ///< the drive does not stop in between (change on set-point)
};

/// Profile position: hands set-points to the drive one by one, as fast as it takes them.
class SetPoints {
public:
    static constexpr std::size_t room = 16;

    /// False: there is no room. An immediate one takes the place of all that wait. [realtime]
    bool push(const SetPoint&) noexcept;
    void clear() noexcept { count_ = 0, phase_ = Phase::idle, failure_ = {}; }
    /// Once per cycle: bits 4, 5, 6 and 9 of the controlword, and the target that belongs to them. [realtime]
    std::uint16_t step(std::uint16_t statusword, Time now, Time limit, std::int32_t& target) noexcept;
    std::size_t waiting() const noexcept { return count_; }
    /// All is handed over, and the drive reached the last. [realtime]
    bool done() const noexcept { return done_; }
    /// The handshake broke; clear() ends it.
    const Failure& failure() const noexcept { return failure_; }

private:
    enum class Phase : std::uint8_t { idle, shown, raised, settling };
    void enter(Phase phase, Time now) noexcept { phase_ = phase, since_ = now, cycles_ = 0; }
    void check(std::uint16_t statusword, Time now, Time limit) noexcept;

    std::array<SetPoint, room> queue_{};
    std::size_t first_ = 0, count_ = 0;
    SetPoint now_;
    Phase phase_ = Phase::idle;
    Time since_ = 0;
    unsigned cycles_ = 0;
    bool done_ = true;
    Failure failure_;
};

/// Homing: starts it, and knows an old "attained" or "error" from that of this run.
class HomingRun {
public:
    enum class Result : std::uint8_t { running, attained, failed };
    void begin() noexcept { phase_ = Phase::fresh, failure_ = {}; }
    /// Once per cycle, in mode hm. `settle`: as long an old result may stay; `limit`: for all of it, 0: none. Bit 4 of the controlword
    /// is to be set while it runs. A halt stops the clock. [realtime]
    Result step(std::uint16_t statusword, bool halted, Time now, Time settle, Time limit) noexcept;
    const Failure& failure() const noexcept { return failure_; }

private:
    enum class Phase : std::uint8_t { fresh, old_result, running };
    Result fail(Cause, std::uint16_t statusword, Time waited) noexcept;

    Phase phase_ = Phase::fresh;
    Time since_ = 0, last_ = 0;
    bool error_seen_ = false;
    Failure failure_;
};

}  // namespace hal::canopen::cia402
