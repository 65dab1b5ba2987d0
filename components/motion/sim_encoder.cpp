// SPDX-License-Identifier: MIT
#include <atomic>
#include <cmath>
#include <cstdint>

#include "hal/component.hpp"

namespace {

struct SimEncoder : hal::Component {
    using Component::Component;

    hal::Function make{*this, "make-pulses", &SimEncoder::make_pulses, "generates the phases; belongs in the fastest thread", {.shared = true}};
    hal::Out<bool> phase_a{*this, make, "phase-A", "phase A, leading while speed is positive"};
    hal::Out<bool> phase_b{*this, make, "phase-B", "phase B"};
    hal::Out<bool> phase_z{*this, make, "phase-Z", "index pulse, one count wide, once per revolution"};
    hal::Out<std::int32_t> raw_counts{*this, make, "rawcounts", "counts since the start, four per pulse"};
    hal::Param<std::uint32_t> pulses{*this, make, "ppr", "pulses per revolution, four counts each", {.initial = 100}};

    hal::Function run{*this, "update-speed", &SimEncoder::update_speed, "reads the speed; belongs in the servo thread", {.shared = true}};
    hal::In<double> speed{*this, run, "speed", "speed in user units per second"};
    hal::Param<double> scale{*this, run, "scale", "user units per revolution", {.initial = 1.0}};

    void make_pulses(hal::Cycle cycle) noexcept {
        const std::int64_t per_turn = 4 * static_cast<std::int64_t>(pulses);
        // At most one edge per cycle: more could not be distinguished from fewer.
        const double step = turns_per_second_.load(std::memory_order_relaxed) * static_cast<double>(per_turn) * cycle.seconds();
        place_ += step > 1.0 ? 1.0 : step < -1.0 ? -1.0 : step;
        const double whole = std::floor(place_);
        place_ -= whole;
        count_ += static_cast<std::int64_t>(whole);

        phase_a = ((count_ + 1) & 2) != 0;
        phase_b = (count_ & 2) != 0;
        phase_z = per_turn > 0 && count_ % per_turn == 0;
        raw_counts = static_cast<std::int32_t>(count_);
    }

    void update_speed(hal::Cycle) noexcept {
        const double turns = scale != 0.0 ? speed / scale : speed.get();
        turns_per_second_.store(std::isfinite(turns) ? turns : 0.0, std::memory_order_relaxed);
    }

private:
    std::atomic<double> turns_per_second_{0.0};  // update-speed writes, make-pulses reads
    // make-pulses only
    std::int64_t count_ = 0;
    double place_ = 0.5;  // between two edges, 0 to 1
};

}  // namespace

HAL_COMPONENT(SimEncoder, "sim_encoder", "Simulated quadrature encoder that turns at a commanded speed", R"(
Generates the phases of an encoder with `ppr` pulses per revolution whose shaft turns at `speed` / `scale` revolutions per second.
`sim-encoder.update-speed` belongs in the servo thread, `sim-encoder.make-pulses` in the fastest thread; it generates at most one
edge per period T, so the speed is limited to 1 / (4 ppr T) revolutions per second.

    loadrt sim_encoder num_chan=1
    loadrt encoder num_chan=1
    addf sim-encoder.make-pulses base-thread
    addf encoder.update-counters base-thread
    addf sim-encoder.update-speed servo-thread
    net A sim-encoder.0.phase-A => encoder.0.phase-A
    net B sim-encoder.0.phase-B => encoder.0.phase-B
)")
