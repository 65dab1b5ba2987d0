// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>

#include "hal/component.hpp"
#include "hal/limit.hpp"
#include "hal/retained.hpp"
#include "linear.hpp"

namespace {

struct Finger : hal::Component {
    using Component::Component;

    hal::In<double> effort{*this, "effort", "force of the actuator", {.unit = "N"}};
    hal::In<bool> reset{*this, "reset", "TRUE holds the finger at 0"};
    hal::In<double> wall{*this, "wall", "position of the wall", {.initial = 0.01, .unit = "m"}};

    hal::Param<double> mass{
        *this, "mass", "moving mass of finger and actuator", {.initial = 0.5, .unit = "kg"}};
    hal::Param<double> viscous{
        *this, "viscous", "viscous friction", {.initial = 4.0, .unit = "N*s/m"}};
    hal::LimitParam max_effort{
        *this, "max-effort", "maximum force of the actuator", {.initial = 100.0, .unit = "N"}};
    hal::Param<double> actuator_lag{*this,
                                    "actuator-lag",
                                    "time constant of the actuator's force",
                                    {.initial = 0.002, .unit = "s"}};
    hal::Param<double> wall_stiffness{*this,
                                      "wall-stiffness",
                                      "stiffness of the wall (default: a steel sheet on a bench)",
                                      {.initial = 2e4, .unit = "N/m"}};
    hal::Param<double> wall_damping{*this,
                                    "wall-damping",
                                    "damping of the wall while the finger moves into it",
                                    {.initial = 50.0, .unit = "N*s/m"}};

    hal::Out<double> position{
        *this, "position", "position of the fingertip", {.unit = "m", .finite = true}};
    hal::Out<double> velocity{
        *this, "velocity", "velocity of the fingertip", {.unit = "m/s", .finite = true}};
    hal::Out<double> force{*this,
                           "force",
                           "force of the finger on the wall; never negative",
                           {.unit = "N", .finite = true}};
    hal::Out<bool> touching{*this, "touching", "TRUE while the finger touches the wall"};

    hal::Function run{*this, "update", &Finger::update, "simulates one period"};

    void update(hal::Cycle cycle) noexcept {
        const double m = sim::sane(mass, 1e-6);
        const double b = sim::sane(viscous, 0.0);

        const double k = sim::sane(wall_stiffness, 0.0);
        const double d = sim::sane(wall_damping, 0.0);
        const double max = sim::sane(max_effort, 0.0);

        const double wanted = std::clamp(sim::force(effort), -max, max);
        const double edge = sim::force(wall);
        const double lag = sim::sane(actuator_lag, 0.0);
        const std::int64_t steps =
            std::clamp<std::int64_t>(cycle.period_ns() / max_step_ns, 1, 10'000);
        const double h = cycle.seconds() / static_cast<double>(steps);
        for (std::int64_t i = 0; i < steps && !reset; ++i) {
            push_ += (wanted - push_) * (lag > 0.0 ? -std::expm1(-h / lag) : 1.0);
            // velocity first, with friction and wall at the end of the step: stable for any
            // stiffness
            const double inside = x_ > edge || x_ + v_ * h > edge ? 1.0 : 0.0;
            const double stiff = m / h + b + inside * (d + k * h);
            v_ = (m / h * v_ + push_ - inside * k * std::fmax(x_ - edge, 0.0)) / stiff;
            x_ += v_ * h;
        }
        if (reset || !(std::fabs(x_) + std::fabs(v_) < 1e9)) {
            x_ = v_ = push_ = 0.0;
        }
        const double push = contact(x_ - edge, v_, k, d);
        position = x_;
        velocity = v_;
        force = push;
        touching = x_ > edge;
    }

private:
    static constexpr std::int64_t max_step_ns = 20'000;

    static double contact(double depth, double speed, double k, double d) noexcept {
        return depth > 0.0 ? std::fmax(k * depth + d * speed, 0.0) : 0.0;
    }

    double x_ = 0.0;
    double v_ = 0.0;
    double push_ = 0.0;
    hal::Retained retained_{*this, {{"x", x_}, {"v", v_}, {"push", push_}}};
};

}  // namespace

HAL_COMPONENT(Finger, "finger", "Simulated robot finger in front of a stiff wall", R"(
    mass x'' = actuator - viscous x' - wall,   wall = max(0, wall-stiffness depth + wall-damping x') where depth = x - wall > 0
    actuator-lag actuator' = effort - actuator

The wall pushes but never pulls. The integration is backward Euler with steps of 20 us. With the
default parameters the finger oscillates on the wall with √(k / m) = 200 rad/s, damped to a quarter.
Numbers are assumed; those of a small gripper against a sheet of steel.

    loadrt finger names=tip
    addf tip.update servo
    net push    => tip.effort
    net contact <= tip.force
)")
