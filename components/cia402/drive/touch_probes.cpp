// SPDX-License-Identifier: MIT
#include "cia402/drive/touch_probes.hpp"

namespace hal::cia402 {

namespace {

struct Edge {
    bool rising;
    std::uint16_t requested, stored;
};
constexpr Edge edges[] = {
    {true, probe::positive_edge, probe::positive_stored},
    {false, probe::negative_edge, probe::negative_stored},
};

}  // namespace

void TouchProbes::power_up() noexcept {
    function_before_ = 0;
    armed_ = {};
}

/// Function and status of probe 2 are 8 bits further up.
void TouchProbes::step() noexcept {
    for (unsigned n = 0; n < 2; ++n) {
        const unsigned shift = 8 * n;
        auto status = static_cast<std::uint8_t>(values_.probe_status >> shift);
        step_probe(n, values_.probe_function >> shift & 0xff, function_before_ >> shift & 0xff,
                   status);
        values_.probe_status =
            static_cast<std::uint16_t>((values_.probe_status & ~(0xff << shift)) | status << shift);
    }
    function_before_ = values_.probe_function;
}

std::optional<double> TouchProbes::latched(unsigned n, bool rising, bool index) const noexcept {
    const Plant& plant = train_.plant();
    if (index) return plant.index_pulse();
    const Range mounted = plant.probe(n);
    if (const auto place = mounted.edge(plant.before(), plant.place(), rising)) return place;
    // An external input latches the position at which it is sampled.
    const bool still = mounted.holds(plant.place()) == mounted.holds(plant.before());
    if (still && inputs_.changed_to(input::probe_1 << n, rising)) return plant.place();
    return std::nullopt;
}

/// Requesting an edge again arms it; a captured edge rearms only in continuous mode.
void TouchProbes::arm(unsigned n, unsigned function, unsigned before,
                      std::uint8_t& status) noexcept {
    using namespace probe;
    const unsigned requested = function & (positive_edge | negative_edge);
    const bool was_off = (before & enable) == 0;
    const bool afresh = was_off || ((function ^ before) & (continuous | index_pulse)) != 0;
    const unsigned rearmed = afresh ? requested : requested & ~before;
    armed_[n] = static_cast<std::uint8_t>((armed_[n] & requested) | rearmed);
    for (const Edge& edge : edges) {
        if (was_off || (rearmed & edge.requested) != 0) {
            status = static_cast<std::uint8_t>(status & ~edge.stored);
        }
    }
}

void TouchProbes::step_probe(unsigned n, unsigned function, unsigned before,
                             std::uint8_t& status) noexcept {
    using namespace probe;
    if ((function & enable) == 0) {
        status = 0;
        armed_[n] = 0;
        return;
    }
    arm(n, function, before, status);
    status |= enabled;
    for (const Edge& edge : edges) {
        const bool armed = (function & continuous) != 0 || (armed_[n] & edge.requested) != 0;
        if ((function & edge.requested) == 0 || !armed) continue;
        const auto place = latched(n, edge.rising, (function & index_pulse) != 0);
        if (!place) continue;
        values_.probe_positions[2 * n + (edge.rising ? 0 : 1)] =
            train_.scale().shown(*place - train_.encoder_zero());
        armed_[n] = static_cast<std::uint8_t>(armed_[n] & ~edge.requested);
        status = static_cast<std::uint8_t>((status | edge.stored) ^ updated);
    }
}

}  // namespace hal::cia402
