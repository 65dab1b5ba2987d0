// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "hal/component.hpp"
#include "hal/limit.hpp"
#include "hal/retained.hpp"
#include "motor.hpp"
#include "quadrature.hpp"

namespace {

struct DcMotor : hal::Component {
    using Component::Component;

    hal::Function run{*this, "update", &DcMotor::update, "simulates one period"};

    hal::In<double> voltage{
        *this, "voltage", "voltage at the terminals; the pwm input adds to it", {.unit = "V"}};
    hal::In<bool> pwm{*this, "pwm", "TRUE: the amplifier applies the supply voltage to the motor"};
    hal::In<bool> direction{*this, "dir", "TRUE reverses the direction of pwm"};
    hal::In<bool> enable{*this,
                         "enable",
                         "FALSE: the amplifier is off and the motor carries no current",
                         {.initial = true}};
    hal::In<double> load{
        *this, "load-torque", "load torque, positive against positive rotation", {.unit = "N*m"}};

    hal::Out<double> current{*this, "current", "winding current", {.unit = "A", .finite = true}};
    hal::Out<double> torque{
        *this, "torque", "motor torque, before friction", {.unit = "N*m", .finite = true}};
    hal::Out<double> velocity{
        *this, "velocity", "speed of the shaft", {.unit = "rad/s", .finite = true}};
    hal::Out<double> angle{*this, "angle", "shaft angle", {.unit = "rad", .finite = true}};
    hal::Out<double> position{
        *this, "position", "position of the load: revolutions * pitch", {.finite = true}};
    hal::Out<std::int32_t> counts{*this, "counts", "encoder counts"};
    hal::Out<bool> phase_a{*this, "phase-A", "encoder phase A"};
    hal::Out<bool> phase_b{*this, "phase-B", "encoder phase B"};
    hal::Out<bool> phase_z{*this, "phase-Z", "encoder index: TRUE at count 0 of every revolution"};
    hal::Out<bool> at_min{*this, "at-min", "limit switch: position is at or below min-position"};
    hal::Out<bool> at_max{*this, "at-max", "limit switch: position is at or above max-position"};

    hal::Param<double> supply{
        *this, "supply-voltage", "supply voltage of the amplifier", {.initial = 24.0, .unit = "V"}};
    hal::OptionalLimitParam limit{*this,
                                  "current-limit",
                                  "current limit of the amplifier; 0: no limit",
                                  {.initial = 4.0, .unit = "A"}};
    hal::Param<double> resistance{
        *this, "resistance", "winding resistance", {.initial = 0.68, .unit = "Ohm"}};
    hal::Param<double> inductance{
        *this, "inductance", "winding inductance; 0: none", {.initial = 0.001, .unit = "H"}};
    hal::Param<double> constant{*this,
                                "torque-constant",
                                "torque per current, and voltage per speed",
                                {.initial = 0.0677, .unit = "N*m/A"}};
    hal::Param<double> inertia{*this,
                               "inertia",
                               "inertia of rotor and load at the shaft",
                               {.initial = 2e-4, .unit = "kg*m^2"}};
    hal::Param<double> viscous{
        *this, "viscous", "viscous friction", {.initial = 1e-4, .unit = "N*m*s/rad"}};
    hal::Param<double> coulomb{
        *this, "coulomb", "Coulomb friction", {.initial = 0.008, .unit = "N*m"}};
    hal::Param<double> pitch{
        *this, "pitch", "position units per revolution (a screw's pitch in mm)", {.initial = 1.0}};
    hal::Param<std::uint32_t> encoder_counts{
        *this, "encoder-counts", "counts per revolution after x4 decoding", {.initial = 2000}};
    hal::Param<double> min_position{
        *this, "min-position", "position of the limit switch at-min", {.initial = -1e9}};
    hal::Param<double> max_position{
        *this, "max-position", "position of the limit switch at-max", {.initial = 1e9}};

    void update(hal::Cycle cycle) noexcept {
        const sim::Winding winding{resistance, inductance, constant, limit};
        const double bridge = direction ? -supply : supply.get();
        const double wanted = voltage + (pwm ? bridge : 0.0);
        const double applied = std::clamp(wanted, -std::abs(supply), std::abs(supply));
        const std::int64_t steps =
            std::max<std::int64_t>(1, (cycle.period_ns() + max_step_ns - 1) / max_step_ns);
        const double dt = cycle.seconds() / static_cast<double>(steps);
        for (std::int64_t i = 0; i < steps; ++i) {
            step(winding, applied, dt);
        }
        if (!std::isfinite(angle_ + speed_ + current_)) {
            angle_ = speed_ = current_ = 0.0;
        }
        show();
    }

private:
    static constexpr std::int64_t max_step_ns = 100'000;

    /// Solves the current exactly, then speed and angle by a classical Runge-Kutta step with the
    /// mean torque of the step.
    void step(const sim::Winding& winding, double applied, double dt) noexcept {
        const double before = current_;
        current_ = enable ? winding.step(current_, applied, speed_, dt) : 0.0;
        torque_ = winding.constant * 0.5 * (before + current_);
        if (!(inertia > 0.0)) return;
        const auto slope = [&](double w) {
            return (torque_ - load - viscous * w - sim::coulomb(coulomb, w)) / inertia;
        };
        const double k1 = slope(speed_);
        const double k2 = slope(speed_ + dt / 2 * k1);

        const double k3 = slope(speed_ + dt / 2 * k2);
        const double k4 = slope(speed_ + dt * k3);
        angle_ += dt * speed_ + dt * dt / 6 * (k1 + k2 + k3);
        speed_ += dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
    }

    void show() noexcept {
        current = current_;
        torque = torque_;
        velocity = speed_;
        angle = angle_;
        position = angle_ / (2.0 * std::numbers::pi) * pitch;
        const std::int64_t count = sim::counts_at(angle_, encoder_counts);
        const sim::Quadrature shown(count, encoder_counts);
        counts = static_cast<std::int32_t>(count);
        phase_a = shown.a;
        phase_b = shown.b;
        phase_z = shown.z;
        at_min = position <= min_position;
        at_max = position >= max_position;
    }

    double angle_ = 0.0;
    double speed_ = 0.0;
    double current_ = 0.0;
    double torque_ = 0.0;
    hal::Retained retained_{
        *this, {{"angle", angle_}, {"speed", speed_}, {"current", current_}, {"torque", torque_}}};
};

}  // namespace

HAL_COMPONENT(DcMotor, "dc_motor", "A brushed DC motor with amplifier, encoder, load and screw", R"(
    inductance i' = u - resistance i - torque-constant w,     |i| <= current-limit
    inertia w'    = torque-constant i - load-torque - viscous w - coulomb tanh(w / 0.01 rad/s)

The usual equations (G. Franklin, J. D. Powell, A. Emami-Naeini, *Feedback Control of Dynamic
Systems*, section 2.3). The current is solved exactly over a step, the motion by fourth-order
Runge-Kutta in steps of at most 0.1 ms. Friction is smoothed around standstill: with a constant
torque below the Coulomb torque the shaft creeps. Without load and Coulomb friction the motor
settles at w = u k / (k² + resistance viscous).

The amplifier takes a voltage, or `pwm` and `dir` from `pwmgen`; while `pwm` is low the current
freewheels through the bridge. The default parameters are those of a motor with 24 V and 85 W, as in
the component `furuta`. For the encoder phases the thread must sample every count: with 2000 counts
per revolution, 100 us allow up to 31 rad/s, 50 us up to 62 rad/s.

    loadrt dc_motor names=x-motor
    addf x-motor.update base-thread
    setp x-motor.pitch 5
    net x-pwm => x-motor.pwm
    net x-dir => x-motor.dir
)")
