// SPDX-License-Identifier: MIT
#include "phase_loop.hpp"

#include <algorithm>
#include <cmath>

#include "mesa/hostmot2/registers.hpp"

namespace hal::mesa {

namespace {

constexpr double timer_turn = 65536.0;
constexpr double limit_turn = 16777216.0;
constexpr double phase_turn = 4294967296.0;
constexpr double pull = 1.0 / 16.0;
constexpr std::int64_t long_time = INT64_MAX / 4;

double in_turn(double phase) noexcept {
    const double rest = phase - std::floor(phase);
    return rest < 1.0 ? rest : 0.0;
}

}  // namespace

double PhaseLoop::turns_per_clock() const noexcept {
    const double prescale = std::max(1U, control_0_ >> 24);
    return std::ldexp(base_ / prescale, -static_cast<int>(dds_size));
}

/// Turns until the timer expires: more than 0.
double PhaseLoop::distance_to(unsigned timer) const noexcept {
    const double distance = in_turn(-timers_[timer] / timer_turn - phase_);
    return distance > 1e-12 ? distance : 1.0;
}

std::uint32_t PhaseLoop::sync() noexcept {
    const double error = phase_ < 0.5 ? phase_ : phase_ - 1.0;
    const double limit = (control_0_ & 0xffffffU) / limit_turn;
    phase_ = in_turn(phase_ - std::clamp(error * pull, -limit, limit));
    return static_cast<std::uint32_t>(static_cast<std::int64_t>(error * phase_turn));
}

void PhaseLoop::write(unsigned reg, std::uint32_t value) noexcept {
    switch (reg) {
    case dpll::base_rate: base_ = value; break;
    case dpll::phase_preset:
        preset_ = value;
        phase_ = value / phase_turn;
        break;
    case dpll::control_0: control_0_ = value; break;
    case dpll::control_1: time_constant_ = value >> 16; break;
    case dpll::timers_1_2:
        timers_[0] = static_cast<std::uint16_t>(value);
        timers_[1] = static_cast<std::uint16_t>(value >> 16);
        break;
    case dpll::timers_3_4:
        timers_[2] = static_cast<std::uint16_t>(value);
        timers_[3] = static_cast<std::uint16_t>(value >> 16);
        break;
    default: break;
    }
}

std::uint32_t PhaseLoop::read(unsigned reg) noexcept {
    switch (reg) {
    case dpll::base_rate: return base_;
    case dpll::phase_preset: return preset_;
    case dpll::control_0: return control_0_;
    case dpll::control_1: return time_constant_ << 16 | dds_size;
    case dpll::timers_1_2: return timers_[0] | std::uint32_t{timers_[1]} << 16;
    case dpll::timers_3_4: return timers_[2] | std::uint32_t{timers_[3]} << 16;
    case dpll::sync: return sync();
    default: return 0;
    }
}

std::int64_t PhaseLoop::clocks_to_timer() const noexcept {
    const double rate = turns_per_clock();
    if (!(rate > 0.0)) return long_time;
    double nearest = 1.0;
    for (unsigned n = 0; n < timers; ++n) {
        nearest = std::min(nearest, distance_to(n));
    }
    return std::max<std::int64_t>(1, std::llround(std::ceil(nearest / rate)));
}

unsigned PhaseLoop::advance(std::int64_t clocks) noexcept {
    const double moved = turns_per_clock() * static_cast<double>(clocks);
    unsigned expired = 0;
    for (unsigned n = 0; n < timers; ++n) {
        expired |= distance_to(n) <= moved ? 1U << n : 0U;
    }
    phase_ = in_turn(phase_ + moved);
    return expired;
}

}  // namespace hal::mesa
