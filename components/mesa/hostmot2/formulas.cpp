// SPDX-License-Identifier: MIT
#include "formulas.hpp"

#include <algorithm>
#include <cmath>

#include "mesa/hostmot2/registers.hpp"

namespace hal::mesa {

namespace {

constexpr double two_to_30 = 1073741824.0;
constexpr double two_to_32 = 4294967296.0;

/// Clips to 0..max and cuts the fraction; NaN is 0.
std::uint32_t clipped(double value, double max) noexcept {
    if (!(value > 0.0)) return 0;
    return static_cast<std::uint32_t>(std::min(value, max));
}

}  // namespace

std::int32_t step_rate(double steps_per_s, std::uint32_t clock_hz) noexcept {
    const double rate = steps_per_s * two_to_32 / clock_hz;
    if (std::isnan(rate)) return 0;
    return static_cast<std::int32_t>(std::clamp(rate, -2147483647.0, 2147483647.0));
}

double steps_per_s(std::int32_t rate, std::uint32_t clock_hz) noexcept {
    return rate * (clock_hz / two_to_32);
}

std::uint32_t step_time(double ns, std::uint32_t clock_hz) noexcept {
    return clipped(ns * clock_hz / 1e9, stepgen::max_time);
}

std::uint32_t watchdog_timeout(double ns, std::uint32_t clock_hz) noexcept {
    return clipped(ns * clock_hz / 1e9 - 1.0, watchdog::max_timeout);
}

double watchdog_ns(std::uint32_t timeout, std::uint32_t clock_hz) noexcept {
    return (timeout + 1.0) * 1e9 / clock_hz;
}

std::uint32_t timestamp_divider(double hz, std::uint32_t clock_hz) noexcept {
    return clipped(clock_hz / hz - 2.0, 0xffff);
}

double timestamp_hz(std::uint32_t divider, std::uint32_t clock_hz) noexcept {
    return clock_hz / (divider + 2.0);
}

std::uint32_t encoder_filter(double hz, std::uint32_t clock_hz) noexcept {
    return clipped(clock_hz / hz - 2.0, 0xfff);
}

std::uint32_t encoder_skew(double ns, std::uint32_t clock_hz) noexcept {
    return clipped(ns * clock_hz / 1e9 + 0.5, encoder::max_skew);
}

PwmRate pwm_rate(double hz, std::uint32_t clock_hz) noexcept {
    PwmRate result;
    for (result.bits = 12; result.bits >= 9; --result.bits) {
        const double rate = hz * 65536.0 * (1U << result.bits) / clock_hz;
        result.rate = clipped(rate, 65535.0);
        if (rate < 65536.0 || result.bits == 9) break;
    }
    return result;
}

double pwm_hz(const PwmRate& rate, std::uint32_t clock_hz) noexcept {
    return static_cast<double>(clock_hz) * rate.rate / 65536.0 / (1U << rate.bits);
}

std::uint32_t pdm_rate(double pulses_per_s, std::uint32_t clock_hz) noexcept {
    return clipped(pulses_per_s * 65536.0 / clock_hz, 65535.0);
}

std::uint32_t pwm_value(double duty, unsigned bits) noexcept {
    const double most = (1U << bits) - 1.0;
    const std::uint32_t magnitude = clipped(std::abs(duty) * most, most) << 16;
    return duty < 0.0 ? magnitude | pwm::negative : magnitude;
}

double pwm_duty(std::uint32_t value, unsigned bits) noexcept {
    const double most = (1U << bits) - 1.0;
    const double magnitude = (value & ~pwm::negative) / 65536.0 / most;
    return (value & pwm::negative) != 0 ? -magnitude : magnitude;
}

std::uint32_t three_phase_rate(double hz, std::uint32_t clock_hz) noexcept {
    return clipped(hz * 65536.0 * 2048.0 / clock_hz, 65535.0);
}

std::uint32_t three_phase_value(double a, double b, double c) noexcept {
    std::uint32_t value = 0;
    for (const double duty : {c, b, a}) {
        const double within = std::isfinite(duty) ? std::clamp(duty, -1.0, 1.0) : 0.0;
        const auto bits = static_cast<std::uint32_t>(512.0 + 511.0 * within);
        value = value << three_phase_pwm::duty_bits | bits;
    }
    return value;
}

double three_phase_duty(std::uint32_t value, unsigned phase) noexcept {
    const std::uint32_t bits = value >> phase * three_phase_pwm::duty_bits & 0x3ffU;
    return (bits - 512.0) / 511.0;
}

std::uint32_t three_phase_dead_time(double ns, std::uint32_t rate,
                                    std::uint32_t clock_hz) noexcept {
    const double unit_ns = 2.0 * 65536.0 * 1e9 / clock_hz / std::max(rate, 1U);
    return clipped(ns / unit_ns, three_phase_pwm::max_dead_time);
}

std::uint32_t three_phase_sample(double share) noexcept {
    return clipped(std::min(share, 1.0) * 1023.0, 1023.0);
}

std::uint32_t ssr_rate(double hz, std::uint32_t clock_hz) noexcept {
    return clipped(clock_hz / (2.0 * hz) - 2.0, 0xfff);
}

std::uint32_t scan_divider(double hz, std::uint32_t clock_hz) noexcept {
    return clipped(clock_hz / 4.0 / hz - 1.0, 0x3ff);
}

double scan_hz(std::uint32_t divider, std::uint32_t clock_hz) noexcept {
    return clock_hz / 4.0 / (divider + 1.0);
}

DpllRate dpll_rate(double hz, unsigned dds_size, std::uint32_t clock_hz) noexcept {
    const double full = std::ldexp(hz, static_cast<int>(dds_size));
    DpllRate result;
    result.prescale = std::max(1U, clipped(two_to_30 * clock_hz / full, 255.0));
    result.base = clipped(full * result.prescale / clock_hz, two_to_32 - 1.0);
    return result;
}

std::uint16_t dpll_timer(double us, double period_us) noexcept {
    const double turns = -us / period_us;
    if (!(std::abs(turns) < 1.0)) return 0;
    return static_cast<std::uint16_t>(static_cast<std::int32_t>(turns * 65536.0));
}

double dpll_phase_us(std::uint32_t sync, double period_us) noexcept {
    return static_cast<std::int32_t>(sync) * period_us / two_to_32;
}

}  // namespace hal::mesa
