// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "floor_argument.hpp"
#include "hal/component.hpp"
#include "hal/retained.hpp"

namespace {

struct SimInfrared : hal::Component {
    using Component::Component;
    static constexpr std::size_t sensors = 16;

    hal::TextArgument floor_file{
        *this, "floor", "",
        "file beside the netlist with walls and obstacles; default: an empty floor"};

    hal::In<double> x{*this, "x", "true x of the robot", {.unit = "m"}};
    hal::In<double> y{*this, "y", "true y of the robot", {.unit = "m"}};
    hal::In<double> heading{*this, "heading", "true heading of the robot", {.unit = "rad"}};
    hal::Param<double> apothem{*this,
                               "apothem",
                               "distance of the sides of the octagon from its centre",
                               {.initial = 0.22, .unit = "m"}};
    hal::Param<double> spread{*this,
                              "spread",
                              "distance of the two sensors of a side from its middle",
                              {.initial = 0.045, .unit = "m"}};
    hal::Param<double> constant{*this,
                                "constant",
                                "reading times the square of distance + offset, head-on",
                                {.initial = 40.0}};
    hal::Param<double> offset{
        *this, "offset", "offset of the distance", {.initial = 0.05, .unit = "m"}};
    hal::Param<double> range{*this,
                             "range",
                             "distance beyond which nothing is reflected",
                             {.initial = 0.8, .unit = "m"}};

    hal::Outs<std::uint32_t> value{
        *this, "value-##", sensors,
        "newest reading of sensor ##, 0..4095: with emission less without"};
    hal::Out<bool> ring{*this, "ring",
                        "TRUE for the cycle in which the last sensor of the ring was read"};
    hal::Out<std::uint32_t> rings{*this, "rings", "complete rings"};

    hal::Function run{*this, "update", &SimInfrared::update,
                      "reads the sensors whose time has come"};

    hal::mobile::FloorPlan floor = hal::mobile::floor_from(*this, floor_file.get());

    void update(hal::Cycle cycle) noexcept {
        if (!begun_) {
            next_ns_ = cycle.start_ns() + sensor_ns;
            begun_ = true;
        }
        bool complete = false;
        for (std::size_t n = 0; n < sensors && next_ns_ <= cycle.start_ns(); ++n) {
            value[at_] = read(at_);
            at_ = (at_ + 1) % sensors;
            next_ns_ += sensor_ns;
            complete = complete || at_ == 0;
        }
        // a thread slower than the ring
        if (next_ns_ <= cycle.start_ns()) {
            next_ns_ = cycle.start_ns() + sensor_ns;
        }
        ring = complete;
        if (complete) {
            rings = rings + 1;
        }
    }

private:
    static constexpr std::int64_t sensor_ns = 592'000;  // 244 us without emission, 348 us with it

    std::uint32_t read(std::size_t sensor) const noexcept {
        if (!(std::fabs(x) < 1e6 && std::fabs(y) < 1e6 && std::fabs(heading) < 1e6)) return 0;
        const double facing = heading + static_cast<double>(sensor / 2) * std::numbers::pi / 4;
        const double aside = sensor % 2 == 0 ? -spread : spread.get();
        const double c = std::cos(facing);
        const double s = std::sin(facing);
        const auto hit =
            floor.cast(x + apothem * c - aside * s, y + apothem * s + aside * c, facing, range);
        if (!std::isfinite(hit.distance)) return 0;
        const double near = hit.distance + offset;
        return static_cast<std::uint32_t>(
            std::clamp(std::round(constant * hit.incidence / (near * near)), 0.0, 4095.0));
    }

    std::int64_t next_ns_ = 0;
    std::size_t at_ = 0;
    bool begun_ = false;
    hal::Retained retained_{*this, {{"next-ns", next_ns_}, {"at", at_}, {"begun", begun_}}};
};

}  // namespace

HAL_COMPONENT(SimInfrared, "sim_infrared",
              "A ring of 16 infrared sensors on an octagon, on a floor with obstacles", R"(
    reading = constant cos(incidence) / (distance + offset)^2,  clipped to 0..4095

Two sensors on each side of an octagon face outwards; side 1 faces forwards, the sides are counted
to the left, and sensors 2 n and 2 n + 1 are those of side n + 1. They are read in turn, 592 us
each, so a ring takes 9.472 ms. `ring` is TRUE in the cycle in which a ring is complete.

The floor plan is that of `sim_diff_base`.

    loadrt sim_infrared names=ring
    addf ring.update servo
    net true-x       => ring.x
    net true-y       => ring.y
    net true-heading => ring.heading
    net front-right  <= ring.value-00
)")
