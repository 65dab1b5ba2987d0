// SPDX-License-Identifier: MIT
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>

#include "hal/component.hpp"
#include "hal/retained.hpp"

namespace {

struct SimEncoder : hal::Component {
    using Component::Component;

    hal::Function make{*this,
                       "make-pulses",
                       &SimEncoder::make_pulses,
                       "generates the phases; belongs in the fastest thread",
                       {.shared = true}};
    hal::Out<bool> phase_a{*this, make, "phase-A", "phase A, leading while speed is positive"};
    hal::Out<bool> phase_b{*this, make, "phase-B", "phase B"};
    hal::Out<bool> phase_z{*this, make, "phase-Z",
                           "index pulse, one count wide, once per revolution"};
    hal::Out<std::int32_t> raw_counts{*this, make, "rawcounts",
                                      "counts since the start, four per pulse"};

    hal::Function run{*this,
                      "update-speed",
                      &SimEncoder::update_speed,
                      "reads the speed; belongs in the servo thread",
                      {.shared = true}};
    hal::In<double> speed{*this, run, "speed", "speed in user units per second"};
    hal::Io<std::uint32_t> pulses{
        *this, run, "ppr", "pulses per revolution, four counts each", {.initial = 100}};
    hal::Io<double> scale{
        *this, run, "scale", "user units per revolution; 0 is set to 1", {.initial = 1.0}};

    void make_pulses(hal::Cycle cycle) noexcept {
        const std::int64_t per_turn = per_turn_.load(std::memory_order_relaxed);
        // At most one edge per cycle: more could not be distinguished from fewer.
        const double step = counts_per_second_.load(std::memory_order_relaxed) * cycle.seconds();
        fraction_ += static_cast<std::int64_t>(std::clamp(step, -1.0, 1.0) * one_count);
        const std::int64_t whole = fraction_ >> fraction_bits;
        fraction_ -= whole << fraction_bits;
        count_ += whole;

        phase_a = (count_ & 2) == 0;
        phase_b = ((count_ + 1) & 2) != 0;
        phase_z = (per_turn > 0 ? count_ % per_turn : count_) == 0;
        raw_counts = static_cast<std::int32_t>(count_);
    }

    void update_speed(hal::Cycle) noexcept {
        if (std::fabs(scale) < 1e-20) {
            scale = 1.0;
        }
        const double turns = speed / scale;
        const std::int64_t per_turn = 4 * static_cast<std::int64_t>(pulses.get());
        per_turn_.store(per_turn, std::memory_order_relaxed);
        counts_per_second_.store(std::isfinite(turns) ? turns * static_cast<double>(per_turn) : 0.0,
                                 std::memory_order_relaxed);
    }

private:
    // update-speed writes, make-pulses reads
    std::atomic<double> counts_per_second_{0.0};
    std::atomic<std::int64_t> per_turn_{0};
    static constexpr int fraction_bits = 31;
    static constexpr double one_count = 0x1p31;

    // make-pulses only
    std::int64_t count_ = 0;
    std::int64_t fraction_ = 0;  // of a count, 0 to below 2^31
    hal::Retained retained_{*this,
                            {{"counts-per-second", counts_per_second_},
                             {"per-turn", per_turn_},
                             {"count", count_},
                             {"fraction", fraction_}}};
};

}  // namespace

HAL_COMPONENT(SimEncoder, "sim_encoder",
              "Simulated quadrature encoder that turns at a commanded speed", R"(
Generates the phases of an encoder with `ppr` pulses per revolution whose shaft turns at `speed` /
`scale` revolutions per second. `sim-encoder.update-speed` belongs in the servo thread,
`sim-encoder.make-pulses` in the fastest thread; it generates at most one edge per period T, so the
speed is limited to 1 / (4 ppr T) revolutions per second. It starts with `phase-A` TRUE, at the
index.

**Differences from LinuxCNC:** `rawcounts` is an output (LinuxCNC: declared as an input that the
component writes). At the highest speed it turns forward (LinuxCNC: backwards).

    loadrt sim_encoder num_chan=1
    loadrt encoder num_chan=1
    addf sim-encoder.make-pulses base-thread
    addf encoder.update-counters base-thread
    addf sim-encoder.update-speed servo-thread
    net A sim-encoder.0.phase-A => encoder.0.phase-A
    net B sim-encoder.0.phase-B => encoder.0.phase-B
)")
