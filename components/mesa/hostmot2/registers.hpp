// SPDX-License-Identifier: MIT
// Registers of HostMot2's modules: their numbers, for ModuleAddresses::at(), and their bits.
#pragma once

#include <cstdint>

namespace hal::mesa {

namespace watchdog {
inline constexpr unsigned timeout = 0;
inline constexpr unsigned status = 1;
inline constexpr unsigned reset = 2;
inline constexpr std::uint32_t off = 0x80000000;       ///< bit of the timeout
inline constexpr std::uint32_t max_timeout = 0x7fffffff;
inline constexpr std::uint32_t has_bitten = 1;         ///< of the status; cleared by writing 0
inline constexpr std::uint32_t reload = 0x5a000000;    ///< written to reset
/// A timeout of 1 clock: bites at once.
inline constexpr std::uint32_t bite_now = 1;
}  // namespace watchdog

namespace ioport {
/// Bit n of each is pin n of the port. `direction` 1: output; `source` 1: of the module.
inline constexpr unsigned data = 0;
inline constexpr unsigned direction = 1;
inline constexpr unsigned source = 2;
inline constexpr unsigned open_drain = 3;
inline constexpr unsigned invert = 4;
}  // namespace ioport

namespace stepgen {
inline constexpr unsigned rate = 0;
inline constexpr unsigned accumulator = 1;
inline constexpr unsigned mode = 2;
inline constexpr unsigned direction_setup = 3;
inline constexpr unsigned direction_hold = 4;
inline constexpr unsigned pulse_length = 5;
inline constexpr unsigned pulse_space = 6;
inline constexpr unsigned table_data = 7;
inline constexpr unsigned table_length = 8;
inline constexpr unsigned master_rate = 9;
inline constexpr unsigned dpll_timer = 10;
inline constexpr std::uint32_t max_time = 0x3fff;  ///< clocks; the chip adds one
inline constexpr std::uint32_t all_masters = 0xffffffff;
enum class Mode : std::uint8_t { step_direction = 0, up_down = 1, quadrature = 2, table = 3 };
inline constexpr std::uint32_t mode_mask = 3;
/// Bits of `mode` in firmware that exchanges step and direction (version 42h), and that latches the
/// accumulator as well (C2h). The chip clears the bit that has armed the latch at its event. With a
/// polarity of 1 the rising edge is the event.
inline constexpr std::uint32_t swap_step_direction = 1U << 2;
inline constexpr std::uint32_t latch_on_index = 1U << 4;
inline constexpr std::uint32_t index_polarity = 1U << 5;
inline constexpr std::uint32_t latch_on_probe = 1U << 6;
inline constexpr std::uint32_t probe_polarity = 1U << 7;
/// The upper 24 bits of the latched accumulator, when `mode` is read.
inline constexpr std::uint32_t latch_mask = 0xffffff00;
inline constexpr std::uint8_t version_with_swap = 0x42;
inline constexpr std::uint8_t version_with_latch = 0xc2;
/// The register of DPLL timers: 0 is off.
constexpr std::uint32_t dpll_select(unsigned timer) noexcept { return 0x8000U | timer << 12; }
}  // namespace stepgen

namespace encoder {
/// `count`: bits 0..15 the count, 16..31 the time stamp of the last edge. `control`: bits 0..15
/// control, 16..31 the latch.
inline constexpr unsigned count = 0;
inline constexpr unsigned control = 1;
inline constexpr unsigned timestamp_divider = 2;
inline constexpr unsigned timestamp = 3;
inline constexpr unsigned filter = 4;
inline constexpr unsigned dpll_timer = 5;
inline constexpr std::uint32_t input_a = 1U << 0;
inline constexpr std::uint32_t input_b = 1U << 1;
inline constexpr std::uint32_t input_index = 1U << 2;
inline constexpr std::uint32_t index_polarity = 1U << 3;
inline constexpr std::uint32_t latch_on_index = 1U << 4;
inline constexpr std::uint32_t clear_on_index = 1U << 5;
inline constexpr std::uint32_t just_once = 1U << 6;
inline constexpr std::uint32_t mask_polarity = 1U << 8;
inline constexpr std::uint32_t use_mask = 1U << 9;
inline constexpr std::uint32_t count_up_down = 1U << 10;
inline constexpr std::uint32_t filter_15 = 1U << 11;
inline constexpr std::uint32_t probe_polarity = 1U << 12;
inline constexpr std::uint32_t latch_on_probe = 1U << 13;
inline constexpr std::uint32_t quadrature_error = 1U << 15;
/// `filter`: bits 0..11 the sample rate, 28..31 the skew of multiplexed inputs in clocks.
inline constexpr std::uint32_t max_skew = 15;
inline constexpr unsigned skew_shift = 28;
/// Versions with this bit have a probe input.
inline constexpr std::uint8_t version_with_probe = 0x80;
/// Multiplexed encoders have a skew from this version on.
inline constexpr std::uint8_t version_with_skew = 4;
}  // namespace encoder

namespace pwm {
/// `value`: bits 16..28 the duty, 31 the sign. `enables`: bit per instance.
inline constexpr unsigned value = 0;
inline constexpr unsigned mode = 1;
inline constexpr unsigned pwm_rate = 2;
inline constexpr unsigned pdm_rate = 3;
inline constexpr unsigned enables = 4;
inline constexpr std::uint32_t negative = 0x80000000;
/// Bits 0..1 of the mode: width 9 + n; 3..4: the output.
inline constexpr std::uint32_t triangle = 1U << 2;
inline constexpr std::uint32_t double_buffered = 1U << 5;
inline constexpr std::uint32_t dither = 1U << 6;
enum class Output : std::uint8_t { direction = 0, swapped = 1, up_down = 2, pdm = 3 };
}  // namespace pwm

namespace three_phase_pwm {
/// `value`: three duties of 10 bits, A in the lowest. `setup`: bits 0..8 the dead time in 2 / f, 15
/// the polarity of the fault input, 16..26 the time of the sample. f is the clock x `rate` / 65536.
inline constexpr unsigned value = 0;
inline constexpr unsigned enable = 1;
inline constexpr unsigned setup = 2;
inline constexpr unsigned rate = 3;
inline constexpr unsigned duty_bits = 10;
inline constexpr std::uint32_t max_dead_time = 511;
inline constexpr std::uint32_t fault_on_high = 1U << 15;
inline constexpr unsigned sample_shift = 16;
/// Bits of `enable`. The fault input clears the first and sets the second; a write sets both.
inline constexpr std::uint32_t is_enabled = 1;
inline constexpr std::uint32_t has_fault = 2;
}  // namespace three_phase_pwm

namespace ssr {
inline constexpr unsigned data = 0;
inline constexpr unsigned rate = 1;
inline constexpr std::uint32_t rate_enable = 1U << 12;
}  // namespace ssr

namespace outm {
inline constexpr unsigned data = 0;
}

namespace inm {  // InMux as well
/// `control`: bits 0..4 width - 1, 6..15 scan divider, 16..21 short filter scans, 22..31 long ones.
/// `counters`: four of 8 bits; written, bit 0 of each byte counts four times as fine.
inline constexpr unsigned control = 0;
inline constexpr unsigned filter = 1;
inline constexpr unsigned filtered = 2;
inline constexpr unsigned raw = 3;
inline constexpr unsigned counters = 4;
}  // namespace inm

namespace led {
inline constexpr unsigned data = 0;  ///< bit 31 is CR01, 30 CR02, …
}

namespace dpll {
/// `control_0`: bits 24..31 prescale, 0..23 limit. `control_1`: 0..7 the size of the DDS, read
/// only, 16..31 time constant. `sync`: reading it is the event, and returns the phase error.
inline constexpr unsigned base_rate = 0;
inline constexpr unsigned phase_preset = 1;
inline constexpr unsigned control_0 = 2;
inline constexpr unsigned control_1 = 3;
inline constexpr unsigned timers_1_2 = 4;
inline constexpr unsigned timers_3_4 = 5;
inline constexpr unsigned sync = 6;
}  // namespace dpll

}  // namespace hal::mesa
