// SPDX-License-Identifier: MIT
#include <cstdint>

#include "hal/component.hpp"

namespace {

struct Sphereprobe : hal::Component {
    using Component::Component;
    hal::In<std::int32_t> px{*this, "px", "position of the probe, x, in counts"};
    hal::In<std::int32_t> py{*this, "py", "position of the probe, y, in counts"};
    hal::In<std::int32_t> pz{*this, "pz", "position of the probe, z, in counts"};
    hal::In<std::int32_t> cx{*this, "cx", "centre, x, in counts"};
    hal::In<std::int32_t> cy{*this, "cy", "centre, y, in counts"};
    hal::In<std::int32_t> cz{*this, "cz", "centre, z, in counts"};
    hal::In<std::int32_t> r{*this, "r", "radius in counts"};
    hal::Out<bool> probe_out{*this, "probe-out", "TRUE while the probe touches"};
    hal::Function run{*this, "", &Sphereprobe::update, "detects contact of the probe"};

    void update(hal::Cycle) noexcept {
        const double x = away(px, cx);
        const double y = away(py, cy);
        const double z = away(pz, cz);
        const double radius = static_cast<double>(r);
        const double across = x * x + y * y;
        const bool over_table = across > radius * radius;
        probe_out = over_table ? z < 0.0 : across + z * z <= radius * radius;
    }

private:
    static double away(std::int32_t point, std::int32_t centre) noexcept {
        return static_cast<double>(point) - static_cast<double>(centre);
    }
};

}  // namespace

HAL_COMPONENT(Sphereprobe, "sphereprobe", "Simulated probe over a hemisphere", R"(
A hemisphere with centre (cx, cy, cz) and radius r is on a table at height cz. Beside the
hemisphere, `probe-out` is TRUE while the probe is below the table; above or below the hemisphere,
while it is at most r away from the centre.

    loadrt sphereprobe names=ball
    addf ball servo
    setp ball.r 5000
    net x-counts => ball.px
    net y-counts => ball.py
    net z-counts => ball.pz
    net probe    <= ball.probe-out
)")
