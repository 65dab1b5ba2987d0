// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>

#include "hal/component.hpp"
#include "hal/interruption.hpp"
#include "hal/limit.hpp"
#include "hal/retained.hpp"

namespace {

struct ForceControl : hal::Component {
    using Component::Component;

    hal::In<bool> enable{
        *this, "enable",
        "FALSE sets effort to 0 and position-out to position-command, and clears all state"};
    hal::In<std::uint32_t> mode{*this, "mode",
                                "0 direct: PID on the force; 1 indirect: admittance in front of a "
                                "position loop; 2 impedance; other values disable the controller"};
    hal::In<double> command{*this, "force-command", "commanded contact force", {.unit = "N"}};
    hal::In<double> force{*this, "force", "measured contact force", {.unit = "N"}};
    hal::In<double> position_command{
        *this, "position-command", "commanded position (path)", {.unit = "m"}};
    hal::In<double> position{*this, "position", "measured position, for impedance", {.unit = "m"}};
    hal::In<double> velocity{
        *this, "velocity", "measured velocity, for direct and impedance", {.unit = "m/s"}};

    hal::In<double> pgain{*this, "Pgain", "direct: effort per error", {.initial = 0.5}};
    hal::In<double> igain{
        *this, "Igain", "direct: effort per error and second", {.initial = 20.0, .unit = "1/s"}};
    hal::In<double> dgain{*this, "Dgain", "direct: effort per rate of the error", {.unit = "s"}};
    hal::In<double> feed{*this, "FF0", "direct: effort per force-command", {.initial = 1.0}};
    hal::In<double> brake{*this,
                          "velocity-damping",
                          "direct: damping of the velocity; limits the speed before contact",
                          {.unit = "N*s/m"}};
    hal::In<double> mass{*this, "m", "admittance: virtual mass", {.initial = 1.0, .unit = "kg"}};
    hal::In<double> damping{
        *this, "c", "admittance and impedance: damping", {.initial = 200.0, .unit = "N*s/m"}};
    hal::In<double> stiffness{*this,
                              "k",
                              "admittance and impedance: spring to the path; 0 in an admittance "
                              "leaves no error of the force",
                              {.unit = "N/m"}};

    hal::OptionalLimit max_effort{
        *this, "max-effort", "limit of effort; 0: no limit", {.unit = "N"}};
    hal::OptionalLimit max_offset{*this,
                                  "max-offset",
                                  "admittance: limit of the offset from the path; 0: no limit",
                                  {.unit = "m"}};

    hal::Out<double> effort{*this,
                            "effort",
                            "command for the actuator; direct and impedance",
                            {.unit = "N", .safe = 0.0, .finite = true}};
    hal::Out<double> position_out{*this,
                                  "position-out",
                                  "command for the position loop; admittance",
                                  {.unit = "m", .finite = true}};
    hal::Out<double> velocity_out{*this,
                                  "velocity-out",
                                  "derivative of position-out",
                                  {.unit = "m/s", .safe = 0.0, .finite = true}};
    hal::Out<double> error{*this, "error", "force-command - force", {.unit = "N"}};
    hal::Out<bool> saturated{*this, "saturated", "TRUE: effort or offset is at its limit"};
    hal::Out<std::uint32_t> bad_inputs{
        *this, "bad-inputs",
        "cycles with a NaN or infinite input: effort is 0 and position-out is held"};

    hal::Function run{*this, "update", &ForceControl::update, "runs one step of the controller"};

    void update(hal::Cycle cycle) noexcept {
        const double dt = cycle.seconds();
        const double path = position_command;
        const double e = command - force;
        if (!std::isfinite(e + path + velocity + position)) {
            bad_inputs = bad_inputs + 1;
            effort = velocity_out = 0.0;
            saturated = false;
            return;
        }
        error = e;
        if (interruption_.accept()) {
            started_ = false;
            speed_ = 0.0;
        }
        const double path_speed = started_ ? (path - path_) / dt : 0.0;

        const double rate = started_ ? (e - error_) / dt : 0.0;
        path_ = path;
        error_ = e;
        started_ = true;
        if (!enable) return rest(path);
        if (mode != mode_) {
            rest(path);
            mode_ = mode;
        }
        switch (mode) {
        case 0: return direct(e, rate, path, dt);
        case 1: return comply(e, path, path_speed, dt);
        case 2: return impede(path, path_speed);
        default: return rest(path);
        }
    }

private:
    static double within(double value, double limit) noexcept {
        return limit > 0.0 ? std::clamp(value, -limit, limit) : value;
    }

    void direct(double e, double rate, double path, double dt) noexcept {
        const double next = integral_ + e * dt;
        const double wanted =
            feed * command + pgain * e + igain * next + dgain * rate - brake * velocity;
        const double given = within(wanted, max_effort);
        // anti-windup: at the limit, integrate only away from it
        if (std::isfinite(next) && (given == wanted || (wanted - given) * igain * e < 0.0)) {
            integral_ = next;
        }
        give(given, path, 0.0, given != wanted);
    }

    /// Position and speed of an admittance.
    struct Motion {
        double place = 0.0;
        double speed = 0.0;
    };
    /// Solves m x" + c x' + k x = e over dt exactly, with e constant during dt, for any m, c, k >=
    /// 0.
    static Motion after(Motion now, double e, double m, double c, double k, double dt) noexcept {
        // e / k would lose digits
        if (k > 0.0 && k * dt * dt < 1e-10 * (m + c * dt)) {
            e -= k * now.place;
            k = 0.0;
        }
        if (m <= 0.0) {
            if (c <= 0.0) {
                return k > 0.0 ? Motion{e / k, (e / k - now.place) / dt} : now;
            }
            if (k <= 0.0) {
                return {now.place + e / c * dt, e / c};
            }
            const double rest = e / k;
            const double place = rest + (now.place - rest) * std::exp(-k / c * dt);
            return {place, (e - k * place) / c};
        }
        if (k <= 0.0) {
            if (c <= 0.0) {
                return {now.place + (now.speed + 0.5 * e / m * dt) * dt, now.speed + e / m * dt};
            }
            // fraction of the change to the final speed
            const double end = e / c;
            const double gone = -std::expm1(-c / m * dt);
            return {now.place + end * dt + (now.speed - end) * (m / c) * gone,
                    now.speed + (end - now.speed) * gone};
        }
        const double rest = e / k;
        const double y = now.place - rest;
        const double a = 0.5 * c / m;
        const double square = k / m;

        const double gap = a * a - square;
        // exp(-a dt) cosh(s dt), exp(-a dt) sinh(s dt) / s, with s = sqrt(gap), imaginary below 0
        double even = 0.0;
        double odd = 0.0;
        const double s = std::sqrt(std::fabs(gap));
        if (s * dt < 1e-6) {
            even = std::exp(-a * dt);
            odd = even * dt;
        } else if (gap > 0.0) {
            const double slow = std::exp(-square / (a + s) * dt);
            const double fast = std::exp(-(a + s) * dt);
            even = 0.5 * (slow + fast);
            odd = 0.5 * (slow - fast) / s;
        } else {
            even = std::exp(-a * dt) * std::cos(s * dt);

            odd = std::exp(-a * dt) * std::sin(s * dt) / s;
        }
        return {rest + y * (even + a * odd) + now.speed * odd,
                now.speed * (even - a * odd) - square * y * odd};
    }

    void comply(double e, double path, double path_speed, double dt) noexcept {
        const Motion next = after({offset_, speed_}, e, std::fmax(mass, 0.0),
                                  std::fmax(damping, 0.0), std::fmax(stiffness, 0.0), dt);
        const double moved = next.place;
        const double kept = within(moved, max_offset);
        if (std::isfinite(moved) && std::isfinite(next.speed)) {
            offset_ = kept;
            speed_ = kept == moved ? next.speed : 0.0;
        }
        give(0.0, path + offset_, path_speed + speed_, kept != moved);
    }

    void impede(double path, double path_speed) noexcept {
        const double wanted =
            stiffness * (path - position) + damping * (path_speed - velocity) + command;
        const double given = within(wanted, max_effort);
        give(given, path, path_speed, given != wanted);
    }

    void rest(double path) noexcept {
        integral_ = offset_ = speed_ = 0.0;
        give(0.0, path, 0.0, false);
    }
    void give(double push, double place, double speed, bool at_limit) noexcept {
        effort = std::isfinite(push) ? push : 0.0;
        position_out = std::isfinite(place) ? place : path_;
        velocity_out = std::isfinite(speed) ? speed : 0.0;
        saturated = at_limit;
    }

    double integral_ = 0.0;
    double offset_ = 0.0;
    double speed_ = 0.0;
    double path_ = 0.0;
    double error_ = 0.0;
    std::uint32_t mode_ = 0;
    bool started_ = false;
    hal::Interruption interruption_{*this};
    hal::Retained retained_{*this,
                            {{"integral", integral_},
                             {"offset", offset_},
                             {"speed", speed_},
                             {"path", path_},
                             {"error", error_},
                             {"mode", mode_},
                             {"started", started_},
                             {"interruption", interruption_}}};
};

}  // namespace

HAL_COMPONENT(ForceControl, "force_control",
              "Force control of one axis: direct, by an admittance, or as an impedance", R"(
**0, explicit direct.** effort = FF0 command + PID(command - force) - velocity-damping velocity. The
fastest mode; needs an actuator with a force input. The integral adds error × period in every cycle,
this one's error included (backward rectangles); the derivative is the difference of this error and
the last, divided by the period.

**1, explicit indirect.** The error of the force moves the position that an inner loop follows:
offset = A(s) (command - force) with the admittance

    A(s) = 1 / (m s² + c s + k)

and `position-out` = position-command + offset. Works with any position-controlled drive. With `k` 0
the admittance integrates and the error converges to 0; with `k` an error remains that is
proportional to the offset. It is stable against a wall of stiffness K if the inner loop is fast
compared to K / c. The admittance is solved exactly for an error that is constant during the cycle
(zero-order hold): it is stable for any period, and its speed does not depend on the period.

**2, impedance.** effort = k (path - position) + c (path' - velocity) + command: the axis behaves
like a spring around the path; the force depends on the distance of the path inside the wall, and is
as accurate as that distance. Needs no force sensor.

(N. Hogan, *Impedance Control*, ASME J. Dynamic Systems 107, 1985; B. Siciliano, L. Villani, *Robot
Force Control*, 1999.) While effort or offset is at its limit the integrators are held. A change of
`mode` clears all state. While an input is NaN or infinite, effort is 0 and `position-out` is held.

    loadrt force_control names=finger
    addf finger.update servo
    setp finger.mode 1
    setp finger.c 400
    net push-wanted => finger.force-command
    net push        => finger.force
    net place       <= finger.position-out
)")
