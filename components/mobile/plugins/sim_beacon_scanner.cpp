// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "floor_argument.hpp"
#include "hal/component.hpp"
#include "hal/retained.hpp"

namespace {

struct SimBeaconScanner : hal::Component {
    using Component::Component;

    hal::TextArgument floor_file{
        *this, "floor", "",
        "file beside the netlist with lines beacon X Y RADIUS; default: no beacons"};

    hal::In<double> x{*this, "x", "true x of the robot", {.unit = "m"}};
    hal::In<double> y{*this, "y", "true y of the robot", {.unit = "m"}};
    hal::In<double> heading{*this, "heading", "true heading of the robot", {.unit = "rad"}};
    hal::In<std::uint32_t> hidden{*this, "hidden", "bit n: beacon n of the floor plan is hidden"};
    hal::In<std::uint32_t> spurious{*this, "spurious",
                                    "spurious pulses per 1000 turns, as from oxidised slip rings"};
    hal::Param<double> turns{*this, "turns", "speed of the head", {.initial = 10.0, .unit = "1/s"}};
    hal::Param<std::uint32_t> resolution{
        *this, "counts", "encoder counts of a turn of the head", {.initial = 4096}};

    hal::Out<bool> fresh{*this, "new", "TRUE for the cycle in which a reflection ended"};
    hal::Out<std::uint32_t> angle{
        *this, "angle", "angle of its middle, relative to the heading, counts to the left"};
    hal::Out<std::uint32_t> width{*this, "width", "its width, counts"};
    hal::Out<std::uint32_t> time_us{
        *this, "time", "clock of the head at its middle", {.unit = "us"}};
    hal::Out<std::uint32_t> lost{*this, "lost", "reflections lost because two came within a cycle"};

    hal::Function run{*this, "update", &SimBeaconScanner::update, "turns the head by one period"};

    hal::mobile::FloorPlan floor = hal::mobile::floor_from(*this, floor_file.get());

    void update(hal::Cycle cycle) noexcept {
        fresh = false;
        if (!(std::fabs(x) < 1e6 && std::fabs(y) < 1e6 && std::fabs(heading) < 1e6 && turns > 0.0 &&
              turns < 1e4)) {
            return;
        }
        constexpr double full = 2 * std::numbers::pi;
        const double before = head_;
        const double step = full * turns * cycle.seconds();
        head_ += step;
        for (std::size_t i = 0; i < floor.beacons.size(); ++i) {
            if (i < 32 && (hidden >> i & 1) != 0) continue;
            const auto& b = floor.beacons[i];
            const double distance = std::hypot(b.x - x, b.y - y);
            double bearing = std::fmod(std::atan2(b.y - y, b.x - x) - heading, full);
            if (bearing < 0.0) {
                bearing += full;
            }
            // The first multiple of a turn at which the head looks there, from where it was.
            const double at = bearing + full * std::ceil((before - bearing) / full);
            if (at >= head_) continue;
            seen(bearing, distance > b.radius ? 2 * std::asin(b.radius / distance) : full / 4,
                 (at - before) / step, cycle);
        }
        const auto rate = static_cast<double>(std::min<std::uint32_t>(spurious, 100'000)) / 1000 *
                          turns * cycle.seconds();
        if (random() < rate) {
            seen(full * random(), 0.2 * random(), 0.5, cycle);
        }
    }

private:
    void seen(double bearing, double wide, double part, hal::Cycle cycle) noexcept {
        if (fresh) {
            lost = lost + 1;
        }
        const double per_turn = std::max<std::uint32_t>(resolution, 1);
        const auto counts = [&](double a) {
            return static_cast<std::uint32_t>(
                std::fmax(0.0, std::floor(a / (2 * std::numbers::pi) * per_turn)));
        };
        angle = counts(bearing) % std::max<std::uint32_t>(resolution, 1);
        width = std::max<std::uint32_t>(counts(wide), 1);
        const double us =
            1e-3 * static_cast<double>(cycle.start_ns()) - (1.0 - part) * 1e6 * cycle.seconds();
        time_us = static_cast<std::uint32_t>(static_cast<std::int64_t>(us));
        fresh = true;
    }
    double random() noexcept {  // G. Marsaglia, Xorshift RNGs, 2003
        state_ ^= state_ << 13;
        state_ ^= state_ >> 7;
        state_ ^= state_ << 17;
        return static_cast<double>(state_ >> 11) * 0x1p-53;
    }

    double head_ = 0.0;
    std::uint64_t state_ = 0x9E3779B97F4A7C15u;
    hal::Retained retained_{*this, {{"head", head_}, {"state", state_}}};
};

}  // namespace

HAL_COMPONENT(SimBeaconScanner, "sim_beacon_scanner",
              "A rotating laser that meets reflecting beacons", R"(
A laser and a photodiode turn on the robot; each beacon of the floor plan reflects once per turn.
Angles are those at the moment of the reflection, in whole counts to the left of the heading; the
width is that of the beacon, a cylinder, as seen from there. Walls do not hide the beacons; `hidden`
does.

At most one reflection per cycle is given. `spurious` adds pulses at random angles, always in the
same sequence.

    loadrt sim_beacon_scanner names=scanner
    addf scanner.update servo
    net true-x       => scanner.x
    net true-y       => scanner.y
    net true-heading => scanner.heading
    net seen         <= scanner.new
)")
