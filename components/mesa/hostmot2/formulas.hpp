// SPDX-License-Identifier: MIT
// Numbers in HostMot2's registers from and to physical units. Values beyond a register are clipped
// to its range; NaN becomes 0.
#pragma once

#include <cstdint>

namespace hal::mesa {

/// Rate register of a step generator: steps/s x 2^32 / clock. [any]
std::int32_t step_rate(double steps_per_s, std::uint32_t clock_hz) noexcept;
double steps_per_s(std::int32_t rate, std::uint32_t clock_hz) noexcept;
/// Accumulators count 1/65536 step.
inline constexpr double accumulator_per_step = 65536.0;
/// Register of a step time: ns in clocks, at most stepgen::max_time. [any]
std::uint32_t step_time(double ns, std::uint32_t clock_hz) noexcept;

/// Timeout register of the watchdog: the timeout is (value + 1) / clock. [any]
std::uint32_t watchdog_timeout(double ns, std::uint32_t clock_hz) noexcept;
double watchdog_ns(std::uint32_t timeout, std::uint32_t clock_hz) noexcept;

/// Divider of the encoders' time stamps, which count clock / (divider + 2). [any]
std::uint32_t timestamp_divider(double hz, std::uint32_t clock_hz) noexcept;
double timestamp_hz(std::uint32_t divider, std::uint32_t clock_hz) noexcept;
/// Filter register of encoders: clock / Hz - 2, at most FFFh. [any]
std::uint32_t encoder_filter(double hz, std::uint32_t clock_hz) noexcept;

/// Skew of the samples of multiplexed encoders in clocks, 0..15, rounded. [any]
std::uint32_t encoder_skew(double ns, std::uint32_t clock_hz) noexcept;

/// Rate and resolution of PWM.
struct PwmRate {
    std::uint32_t rate = 0;
    unsigned bits = 12;  ///< 9..12
};
/// The most bits that the frequency allows: 12, or fewer where the register would exceed 65535. The
/// clock is the high one. [any]
PwmRate pwm_rate(double hz, std::uint32_t clock_hz) noexcept;
double pwm_hz(const PwmRate& rate, std::uint32_t clock_hz) noexcept;
std::uint32_t pdm_rate(double pulses_per_s, std::uint32_t clock_hz) noexcept;
/// Value register: |duty| x (2^bits - 1) in bits 16.., the sign in bit 31. `duty` -1..1. [any]
std::uint32_t pwm_value(double duty, unsigned bits) noexcept;
double pwm_duty(std::uint32_t value, unsigned bits) noexcept;

/// Rate register of three-phase PWM: Hz x 65536 x 2048 / clock, at most 65535. The clock is the high
/// one. [any]
std::uint32_t three_phase_rate(double hz, std::uint32_t clock_hz) noexcept;
/// Value register of three phases: each 512 + 511 x `duty` of -1..1, in 10 bits. [any]
std::uint32_t three_phase_value(double a, double b, double c) noexcept;
/// Returns the duty of phase 0..2, -1..1. [any]
double three_phase_duty(std::uint32_t value, unsigned phase) noexcept;
/// Dead time of a setup register, in units of 2 x 65536 / (clock x rate). [any]
std::uint32_t three_phase_dead_time(double ns, std::uint32_t rate, std::uint32_t clock_hz) noexcept;
/// Time of the sample of a setup register: 0 the start of a PWM cycle, 1 its end. [any]
std::uint32_t three_phase_sample(double share) noexcept;

/// Rate register of SSR, without its bit of enabling: clock / (2 Hz) - 2, 12 bits. [any]
std::uint32_t ssr_rate(double hz, std::uint32_t clock_hz) noexcept;

/// Scan divider of InM: clock / 4 / (divider + 1) scans per second and channel; 10 bits. [any]
std::uint32_t scan_divider(double hz, std::uint32_t clock_hz) noexcept;
double scan_hz(std::uint32_t divider, std::uint32_t clock_hz) noexcept;

/// Prescaler and base rate of the DPLL.
struct DpllRate {
    std::uint32_t prescale = 1;
    std::uint32_t base = 0;
};
/// prescale = 2^30 x clock / (2^dds_size x Hz), 1..255; base = Hz x 2^dds_size x prescale / clock.
/// [any]
DpllRate dpll_rate(double hz, unsigned dds_size, std::uint32_t clock_hz) noexcept;
/// Timer register: -(us / period) as a fraction of 16 bits. [any]
std::uint16_t dpll_timer(double us, double period_us) noexcept;
/// Phase error in us. [any]
double dpll_phase_us(std::uint32_t sync, double period_us) noexcept;

}  // namespace hal::mesa
