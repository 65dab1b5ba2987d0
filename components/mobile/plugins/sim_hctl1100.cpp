// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <numbers>

#include "hal/component.hpp"
#include "hal/retained.hpp"

namespace {

enum Mode : std::uint32_t { position = 1, proportional = 2, integral = 3, trapezoidal = 4 };

struct SimHctl1100 : hal::Component {
    using Component::Component;

    hal::In<std::uint32_t> mode{
        *this, "mode", "1 position; 2 proportional velocity; 3 integral velocity; 4 trapezoidal"};
    hal::In<bool> on{*this, "on", "FALSE: the motor carries no current"};
    hal::In<std::int32_t> velocity{
        *this, "velocity-cmd",
        "commanded velocity, or the largest in mode 4: 1/16 count per sample"};
    hal::In<std::uint32_t> acceleration{
        *this,
        "acceleration",
        "acceleration in modes 3 and 4: 1/65536 count per sample squared",
        {.initial = 1000}};
    hal::In<std::int32_t> target{*this, "target", "target of modes 1 and 4, counts"};
    hal::In<bool> held{*this, "held",
                       "TRUE: an obstacle holds the machine, and only this wheel's slip remains"};

    hal::Param<double> gain{*this, "K", "gain of the filter", {.initial = 40.0}};
    hal::Param<double> zero{*this, "A", "zero of the filter, 1/256", {.initial = 251.0}};
    hal::Param<double> pole{*this, "B", "pole of the filter, 1/256"};
    hal::Param<double> fastest{*this,
                               "motor-speed",
                               "speed of the wheel at full voltage",
                               {.initial = 12.0, .unit = "rad/s"}};
    hal::Param<double> lag{*this,
                           "motor-time",
                           "mechanical time constant of the motor",
                           {.initial = 0.05, .unit = "s"}};
    hal::Param<std::uint32_t> resolution{
        *this, "counts-per-turn", "encoder counts of a turn of the wheel", {.initial = 20000}};
    hal::Param<std::uint32_t> following_limit{
        *this,
        "following-limit",
        "following error, counts, that raises following-error; 0: none",
        {.initial = 4000}};

    hal::Out<std::int32_t> counts{*this, "counts", "encoder counts"};
    hal::Out<double> angle{*this, "angle", "angle of the wheel", {.unit = "rad", .finite = true}};
    hal::Out<double> speed{*this, "speed", "speed of the wheel", {.unit = "rad/s", .finite = true}};
    hal::Out<double> drive{*this, "drive", "motor command, -1..1", {.finite = true}};
    hal::Out<bool> profile_done{*this, "profile-done",
                                "TRUE: the profile of mode 4 has ended, or no profile runs"};
    hal::Out<bool> stalled{*this, "stalled",
                           "TRUE: more than half of the voltage for 0.3 s, and the wheel rests"};
    hal::Out<bool> following_error{
        *this, "following-error",
        "TRUE: the wheel is farther from its setpoint than following-limit"};

    hal::Function run{*this, "update", &SimHctl1100::update,
                      "simulates controller, motor and encoder over one period"};

    void update(hal::Cycle cycle) noexcept {
        if (!begun_) {
            next_ns_ = cycle.start_ns();
            begun_ = true;
        }
        // Between two samples of the controller its output is constant, so the motor's first-order
        // equation has an exact solution.
        const std::int64_t end = cycle.start_ns() + cycle.period_ns();
        std::int64_t now = cycle.start_ns();
        for (int guard = 0; guard < 1000 && now < end; ++guard) {
            if (next_ns_ <= now) {
                sample();
                next_ns_ = now + sample_ns;
            }
            const std::int64_t until = std::min(end, next_ns_);
            turn(1e-9 * static_cast<double>(until - now));
            now = until;
        }
        counts = static_cast<std::int32_t>(count());
        angle = angle_;
        speed = speed_;
        drive = command_ / 127.0;
        profile_done = profile_ == 0.0;
        const bool rests = on && std::fabs(command_) > 64.0 && std::fabs(speed_) < 0.02 * fastest;
        rest_s_ = rests ? rest_s_ + cycle.seconds() : 0.0;
        stalled = rest_s_ > 0.3;
    }

private:
    static constexpr std::int64_t sample_ns = 1'024'000;

    std::int64_t count() const noexcept {
        return static_cast<std::int64_t>(
            std::floor(std::clamp(angle_ / (2 * std::numbers::pi) * resolution, -2e9, 2e9)));
    }
    /// One sample of the HCTL-1100: MC = K/4 (e - A/256 e of the sample before) - B/256 MC of the
    /// sample before.
    void sample() noexcept {
        const double at = static_cast<double>(count());
        const double moved = at - last_;
        last_ = at;
        if (!on) {
            command_ = error_ = profile_ = 0.0;
            setpoint_ = at;
            mode_ = 0;
            following_error = false;
            return;
        }
        if (mode_ != mode) {
            mode_ = mode;
            setpoint_ = at;
            profile_ = moved;
            error_ = 0.0;
        }
        const double step = acceleration / 65536.0;
        const double wanted = velocity / 16.0;
        switch (mode_) {
        case position:
            setpoint_ = target;
            profile_ = 0.0;
            break;
        case integral:
            profile_ = toward(std::clamp(std::trunc(wanted), -127.0, 127.0), step);
            setpoint_ += profile_;
            break;
        case trapezoidal: follow_profile(step, std::clamp(std::fabs(wanted), 0.0, 127.0)); break;
        default: break;
        }
        if (mode_ == proportional) {
            command_ = gain / 4 * (wanted - moved);
            setpoint_ = at;
        } else {
            const double e = setpoint_ - at;
            command_ = gain / 4 * (e - zero / 256 * error_) - pole / 256 * command_;
            error_ = e;
        }
        command_ = std::isfinite(command_) ? std::clamp(command_, -127.0, 127.0) : 0.0;
        following_error = following_limit != 0 && std::fabs(setpoint_ - at) > following_limit;
    }
    double toward(double wanted, double step) const noexcept {
        return profile_ + std::clamp(wanted - profile_, -step, step);
    }
    /// A trapezoid from setpoint_ to target; triangular when it is short.
    void follow_profile(double step, double max) noexcept {
        const double way = target - setpoint_;
        const double stopping = step > 0.0 ? profile_ * profile_ / (2 * step) : 0.0;
        if (std::fabs(way) <= std::fabs(profile_) || std::fabs(way) < 1.0) {
            setpoint_ = target;
            profile_ = 0.0;
            return;
        }
        const bool brake = way * profile_ > 0.0 && stopping >= std::fabs(way) - std::fabs(profile_);
        profile_ =
            brake ? std::copysign(
                        std::fmax(std::fabs(profile_) - step, std::fmin(1.0, std::fabs(way))), way)
                  : toward(std::copysign(max, way), step);
        setpoint_ += profile_;
    }
    /// speed' = (drive fastest - speed) / lag
    void turn(double dt) noexcept {
        const double settled = on ? command_ / 127.0 * fastest : 0.0;
        const double decay = lag > 1e-6 ? std::exp(-dt / lag) : 0.0;
        const double transient = lag > 1e-6 ? lag * (1 - decay) : 0.0;
        if (held) {
            speed_ = 0.0;
        } else {
            angle_ += settled * dt + (speed_ - settled) * transient;
            speed_ = settled + (speed_ - settled) * decay;
        }
        if (!std::isfinite(angle_ + speed_) || std::fabs(angle_) > 1e6) {
            angle_ = speed_ = 0.0;
        }
    }

    double angle_ = 0.0;
    double speed_ = 0.0;
    double setpoint_ = 0.0;
    double profile_ = 0.0;
    double error_ = 0.0;

    double command_ = 0.0;
    double last_ = 0.0;
    double rest_s_ = 0.0;
    std::int64_t next_ns_ = 0;
    std::uint32_t mode_ = 0;
    bool begun_ = false;
    hal::Retained retained_{*this,
                            {{"angle", angle_},
                             {"speed", speed_},
                             {"setpoint", setpoint_},
                             {"profile", profile_},
                             {"error", error_},
                             {"command", command_},
                             {"last", last_},
                             {"rest-s", rest_s_},
                             {"next-ns", next_ns_},
                             {"mode", mode_},
                             {"begun", begun_}}};
};

}  // namespace

HAL_COMPONENT(SimHctl1100, "sim_hctl1100", "A motor behind an HCTL-1100 controller", R"(
The four modes of the motion controller HCTL-1100 (Hewlett-Packard, data sheet 1992), a sample every
1.024 ms:

| mode | does |
| --- | --- |
| 1 | position: goes to `target` without a profile |
| 2 | proportional velocity: 1/16 count per sample, with a steady error |
| 3 | integral velocity: whole counts per sample, -127..127, reached with `acceleration` |
| 4 | trapezoidal: goes to `target` with `acceleration` and at most `velocity-cmd` |

    MC = K/4 (e - A/256 e') - B/256 MC',   -127..127,  ' the sample before
    speed' = (MC/127 motor-speed - speed) / motor-time

`profile-done` is the end of the profile, not the arrival. A change of mode begins at the current
position. The acceleration is that of the registers in counts per sample squared, with 16 fractional
bits.

    loadrt sim_hctl1100 names=left
    addf left.update servo
    setp left.on TRUE
    setp left.mode 3
    setp left.velocity-cmd 160
    net left-wheel <= left.angle
)")
