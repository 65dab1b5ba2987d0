// SPDX-License-Identifier: MIT
// The DPLL of an emulated card.
#pragma once

#include <array>
#include <cstdint>

namespace hal::mesa {

/// A phase that runs with the base rate and is pulled towards the reads of the sync register, and
/// four timers, which are phases. How fast the chip pulls is not documented; here it is a sixteenth
/// of the error in each sync, within the limit. [realtime]
class PhaseLoop {
public:
    static constexpr unsigned timers = 4;
    static constexpr std::uint8_t dds_size = 42;

    explicit PhaseLoop(std::uint32_t clock_hz = 100'000'000) noexcept : clock_hz_(clock_hz) {}

    void write(unsigned reg, std::uint32_t value) noexcept;
    std::uint32_t read(unsigned reg) noexcept;
    /// The clocks until a timer expires next; a large number when the rate is 0.
    std::int64_t clocks_to_timer() const noexcept;
    /// Lets clocks pass, at most clocks_to_timer(). Returns a bit for each timer that expired: bit
    /// n is timer n + 1.
    unsigned advance(std::int64_t clocks) noexcept;

private:
    double turns_per_clock() const noexcept;
    double distance_to(unsigned timer) const noexcept;
    std::uint32_t sync() noexcept;

    std::uint32_t clock_hz_;
    std::uint32_t base_ = 0;
    std::uint32_t preset_ = 0;
    std::uint32_t control_0_ = 0;
    std::uint32_t time_constant_ = 0;
    std::array<std::uint16_t, timers> timers_{};
    double phase_ = 0.0;  ///< turns, 0..1
};

}  // namespace hal::mesa
