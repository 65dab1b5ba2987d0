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
