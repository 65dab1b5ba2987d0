// SPDX-License-Identifier: MIT
// The plants behind an axis_io.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "axis_io.hpp"
#include "sim/furuta_rig.hpp"

namespace hal::canopen {

namespace {

/// A brushed motor turns a screw that moves a slide; the second encoder is at the end of the screw,
/// behind a coupling with backlash.
///   (J + m (p/2pi)^2) w' = k i - viscous w - Coulomb(w) - p/2pi F;   L i' = u - R i - k w
/// 300 W, 48 V; 2000 counts per turn; 5 mm pitch; 20 kg. Typical values of a machine of this size.
class Slide final : public Plant {
public:
    void step(double duty, bool on, Time time_ns) noexcept override {
        const sim::Winding winding{0.4, 0.0008, 0.12, 12.0};
        const auto steps = std::max<Time>(1, (time_ns + max_ns - 1) / max_ns);
        const double dt = static_cast<double>(time_ns) * 1e-9 / static_cast<double>(steps);
        for (Time n = 0; n < steps; ++n) {
            const double before = current_;
            current_ = on ? winding.step(current_, duty * supply_, speed_, dt) : 0.0;
            const double torque = winding.constant * 0.5 * (before + current_) - viscous * speed_ -
                                  sim::coulomb(friction, speed_) - load_force_ * metres_per_rad;
            speed_ += torque / inertia * dt;
            angle_ += speed_ * dt;
        }
        if (!std::isfinite(angle_ + speed_ + current_)) {
            angle_ = speed_ = current_ = 0.0;
        }
        follower_ = std::clamp(follower_, angle_ - backlash / 2, angle_ + backlash / 2);
    }
    std::int64_t count() const noexcept override { return sim::counts_at(angle_, counts); }
    std::int64_t second_count() const noexcept override {
        return sim::counts_at(follower_, counts);
    }
    bool input() const noexcept override { return closed_; }
    double current() const noexcept override { return current_; }
    double position() const noexcept override { return angle_; }
    double second_position() const noexcept override { return follower_; }
    std::span<const Influence> influences() const noexcept override {
        static constexpr Influence rows[] = {
            {"load-force", "force on the slide, against its positive direction", "N", 0.0,
             Influence::value},
            {"supply", "voltage of the amplifier's supply", "V", usual_supply, Influence::value},
            {"input", "the contact at the digital input is closed", "", 1.0, Influence::flag},
        };
        return rows;
    }
    void put(std::size_t n, double value) noexcept override {
        if (!std::isfinite(value)) return;
        if (n == 0) {
            load_force_ = value;
        }
        if (n == 1) {
            supply_ = value;
        }
        if (n == 2) {
            closed_ = value != 0.0;
        }
    }

private:
    static constexpr Time max_ns = 100'000;
    static constexpr std::int64_t counts = 2000;
    static constexpr double metres_per_rad = 0.005 / (2 * std::numbers::pi);
    static constexpr double mass = 20.0;

    static constexpr double rotor = 1.2e-4;

    static constexpr double inertia = rotor + mass * metres_per_rad * metres_per_rad;

    static constexpr double viscous = 2e-4;
    static constexpr double friction = 0.03;

    static constexpr double backlash = 0.002;  // rad

    static constexpr double usual_supply = 48.0;
    double angle_ = 0.0;
    double speed_ = 0.0;
    double current_ = 0.0;
    double follower_ = 0.0;
    double load_force_ = 0.0;

    double supply_ = usual_supply;
    bool closed_ = true;
};

class Pendulum final : public Plant {
public:
    Pendulum() {
        rig_.rest(rig, 0.0, 0.0);
        rig_.show(rig, 0);
    }
    void step(double duty, bool on, Time time_ns) noexcept override {
        if (!rig_.step(rig, duty * supply_, on, time_ns)) {
            rig_.rest(rig, 0.0, 0.0);
        }
        rig_.show(rig, time_ns);
    }
    std::int64_t count() const noexcept override { return rig_.arm_count(); }
    std::int64_t second_count() const noexcept override { return rig_.pendulum_count(); }
    bool input() const noexcept override { return !lifted_ && !rig_.tipped(); }
    double current() const noexcept override { return rig_.current(); }
    double position() const noexcept override { return rig_.state().arm; }
    double second_position() const noexcept override { return rig_.state().pendulum; }
    std::span<const Influence> influences() const noexcept override {
        static constexpr Influence rows[] = {
            {"push",
             "a tap on the pendulum: speed given to its centre of mass; reset to 0 when done",
             "m/s", 0.0, Influence::tap},
            {"supply", "voltage of the amplifier's supply", "V", rig.supply, Influence::value},
            {"lift", "the base is lifted off the table", "", 0.0, Influence::flag},
        };
        return rows;
    }
    void put(std::size_t n, double value) noexcept override {
        if (!std::isfinite(value)) return;
        if (n == 0) {
            rig_.tap(rig, value);
        }
        if (n == 1) {
            supply_ = value;
        }
        if (n == 2) {
            lifted_ = value != 0.0;
        }
    }

private:
    static constexpr sim::FurutaConstants rig{};
    sim::FurutaRig rig_;
    double supply_ = rig.supply;
    bool lifted_ = false;
};

}  // namespace

std::unique_ptr<Plant> make_plant(std::string_view name) {
    if (name == "axis") return std::make_unique<Slide>();
    if (name == "furuta") return std::make_unique<Pendulum>();
    return nullptr;
}

}  // namespace hal::canopen
