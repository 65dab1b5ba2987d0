// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

// How far may the output move in one cycle and still be able to stop at a point `distance` ahead?
//
// In units of one cycle let A be the largest change of the displacement per cycle (maxa * period^2), and let the last
// m cycles before the stop change it by A/m, 2A/m, ... A only (m = smooth-steps - 1, at least 1). Counted back from the
// stop, the displacements of a braking output are then
//     v(j) = A j (j+1) / (2m)             for j <= m
//     v(j) = v(m) + (j - m) A             for j >= m
// and the ways they add up to are
//     p(j) = A j (j+1) (j+2) / (6m)       for j <= m
//     p(j) = p(m) + q v(m) + A q (q+1)/2  for j >= m, with q = j - m
// A distance between p(j) and p(j+1) takes the displacement at the same share between v(j) and v(j+1); what remains
// then lies at that share between p(j-1) and p(j), so the output arrives exactly, in j+1 cycles, and no change is
// larger than A. With m = 1 this is the fastest way there is.
class Approach {
public:
    Approach(double a, double m) noexcept : a_(a), m_(m), pm_(a * (m + 1.0) * (m + 2.0) / 6.0), vm_(a * (m + 1.0) / 2.0) {}

    double operator()(double distance) const noexcept { return std::copysign(magnitude(std::fabs(distance)), distance); }

    /// p(m + 1): the way of the last m + 1 cycles.
    double last_cycles() const noexcept { return pm_ + vm_ + a_; }

private:
    double magnitude(double distance) const noexcept {
        if (distance <= a_ / m_) return distance;
        double v, p, next;
        if (distance < pm_) {
            double j = 1.0, above = m_;  // p(j) <= distance < p(above)
            while (above - j > 1.0) {
                const double middle = std::floor((j + above) / 2.0);
                (start_of(middle) <= distance ? j : above) = middle;
            }
            p = start_of(j);
            v = a_ * j * (j + 1.0) / (2.0 * m_);
            next = a_ * (j + 1.0) * (j + 2.0) / (2.0 * m_);
        } else {
            const double b = 0.5 + vm_ / a_;
            const double q = std::floor(std::sqrt(b * b + 2.0 * (distance - pm_) / a_) - b);
            p = pm_ + q * vm_ + a_ * q * (q + 1.0) / 2.0;
            v = vm_ + q * a_;
            next = v + a_;
        }
        return v + (next - v) * std::clamp((distance - p) / next, 0.0, 1.0);
    }
    double start_of(double j) const noexcept { return a_ * j * (j + 1.0) * (j + 2.0) / (6.0 * m_); }

    double a_, m_, pm_, vm_;
};

struct Limit3 : hal::Component {
    using Component::Component;
    hal::In<double>        in{*this, "in", "the value to follow"};
    hal::Out<double>       out{*this, "out", "follows in within the limits"};
    hal::In<bool>          enable{*this, "enable", "TRUE: out follows in; FALSE: out returns to 0 within the limits", {.initial = true}};
    hal::In<bool>          load{*this, "load", "while TRUE out is in at once, whatever maxv and maxa are"};
    hal::In<double>        min{*this, "min", "lowest output", {.initial = -1e20}};
    hal::In<double>        max{*this, "max", "highest output", {.initial = 1e20}};
    hal::In<double>        max_velocity{*this, "maxv", "largest first derivative of out", {.initial = 1e20}};
    hal::In<double>        max_acceleration{*this, "maxa", "largest second derivative of out", {.initial = 1e20}};
    hal::In<std::uint32_t> smooth_steps{*this, "smooth-steps", "cycles before a stop in which acceleration fades out; 2: the fastest stop",
                                        {.initial = 2}};
    hal::Function          run{*this, "", &Limit3::update, "follows in"};

    void update(hal::Cycle cycle) noexcept {
        const double dt = cycle.seconds();
        const double goal = std::min(std::max(enable ? in.get() : 0.0, min.get()), max.get());
        const double target = std::isfinite(goal) ? goal : started_ ? target_ : position_;
        const double stride = started_ ? target - target_ : 0.0;  // of the target, since the cycle before
        if (load) put(target, dt);
        else follow(target, stride, dt);
        loading_ = load;
        target_ = target;
        last_stride_ = stride;
        started_ = true;
        out = position_;
    }

private:
    static constexpr double full = 1.0 - 1e-9;  // this much of A is A, but for rounding

    void put(double target, double dt) {
        velocity_ = loading_ ? (target - position_) / dt : 0.0;  // how it really moves while it is carried along
        position_ = target;
    }

    void follow(double target, double stride, double dt) {
        const double a = max_acceleration * dt * dt, v = max_velocity > 0.0 ? max_velocity * dt : 0.0;
        if (!(a > 0.0)) {
            velocity_ = 0.0;
            return;
        }
        // A moving target is met at its own speed. Only what two cycles agree on counts as speed, so a step or noise
        // on the input is no motion; and never more than the output could do.
        const bool steady = stride * last_stride_ > 0.0;
        const double common = steady ? std::copysign(std::min(std::fabs(stride), std::fabs(last_stride_)), stride) : 0.0;
        const double drift = std::clamp(common, -v, v);

        const Approach approach(a, static_cast<double>(std::max<std::uint32_t>(smooth_steps, 2) - 1));
        const double before = velocity_ * dt;
        // The displacement towards a point that is `distance` away and moves by `own` per cycle. It changes by all of A or
        // is all of maxv; only the last cycles may take less. Where the fastest way would, the output brakes, and gets what
        // is missing in a later cycle.
        const auto towards = [&](double distance, double own) {
            const double left = distance - own, fastest = own + approach(left);
            if (std::fabs(fastest) >= v || std::fabs(fastest - before) >= a * full) return fastest;
            const double braking = before - std::copysign(a, left);
            const double slower = std::copysign(1.0, left) * (braking - own);
            const bool as_soon = std::fabs(left) - slower <= std::min(a, slower) / full;  // there in the next cycle
            return std::fabs(left) > approach.last_cycles() || as_soon ? braking : fastest;
        };
        double step = towards(target - position_, drift);
        if (std::fabs(step - before) > a * full) step = before + std::copysign(a, step - before);
        step = std::max(step, towards(min - position_, 0.0));
        step = std::min(step, towards(max - position_, 0.0));
        step = std::clamp(step, -v, v);
        step = std::clamp(step, before - a, before + a);
        velocity_ = step / dt;
        // Without this the last bit of rounding would keep it from ever being exactly there.
        const double rounding = 1e-15 * (std::fabs(target) + std::fabs(position_));
        position_ = std::fabs(target - position_ - step) <= rounding ? target : position_ + step;
    }

    double position_ = 0.0, velocity_ = 0.0;
    double target_ = 0.0, last_stride_ = 0.0;  // of the cycle before
    bool started_ = false, loading_ = false;
};

}  // namespace

HAL_COMPONENT(Limit3, "limit3", "Follows a value within limits of position, velocity and acceleration", R"(
`out` goes to `in` as fast as `min`, `max`, `maxv` and `maxa` allow, and stops there without overshoot; it meets a moving
input at its own speed, and follows an input that keeps the limits itself without any lag. It brakes in time for `min`
and `max`. When a limit is moved, or the input turns round, so that the output can no longer stop in time, `maxa` is
kept and the output comes back. It moves with all of `maxa` or all of `maxv` until it is only some cycles from a stop. With
`smooth-steps` above 2 the acceleration fades out over that many cycles: it takes a little longer and is gentle to a
jittering input.

`out` starts at 0; `load` puts it on the input. While the input is not a number its last value counts. With `maxa` not
positive `out` stands still. When `min` is above `max`, `max` wins.

**Otherwise than LinuxCNC's**, which accelerates and cruises the same to the last bits: it stops with `maxa` and is then exactly
there (there each of the last cycles goes half of what is left, for some 30 cycles). It keeps `min` and `max` also with `maxv` and
`maxa` as they are by default (there `out` goes beyond). It leaves `min` and `max` with the input (there some cycles before the
input is back, to have its speed by then). An input that comes nearer faster than `maxv` it brakes towards (there it turns round).
It leaves `load` with the speed at which it was carried and within `maxa` (there within `maxv` at once).

    loadrt limit3 names=jog
    addf jog servo
    setp jog.maxv 50
    setp jog.maxa 400
    net jog-target   => jog.in
    net jog-position <= jog.out
)")
