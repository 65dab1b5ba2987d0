// SPDX-License-Identifier: MIT
// Time-optimal motion within limits of velocity, acceleration, deceleration and jerk, from any
// state to rest at a position or to a velocity. Shared by motion_profile and pxmc_axis.
//
// The kinds of segments and the decisions follow T. Kröger, *On-Line Trajectory Generation in
// Robotic Systems*, Springer 2010, chapters 3 to 5 (a new trajectory from the present state in
// every cycle that brings a change), and L. Biagiotti, C. Melchiorri, *Trajectory Planning for
// Automatic Machines and Robots*, Springer 2008, 3.2 and 3.4 (trapezoidal and double-S profiles).
// With J the jerk, and (v, a) the present state:
//
//   v + a|a| / (2J)                    the speed after the acceleration has faded out: "settled"
//   peak^2 = J dv + a^2 / 2            the acceleration between which and 0 a change of speed by dv goes up and down;
//                                      above the limit it is the limit, held for the rest of dv
//   x = S(w) + T w                     the distance of: to the cruising speed w, at w for a time T, and to a stop
//
// Stopping immediately leads to a point; the target is before or behind it, which gives the sign of
// w. S is continuous and, above the settled speed, increases with w. So either w is the limit and T
// the remaining time, or T = 0 and w the root of S(w) = x. Between the stop point and S(settled)
// while braking, it brakes less for a moment: the root is that acceleration.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

namespace motion {

inline constexpr double unlimited = std::numeric_limits<double>::infinity();
inline constexpr double farthest = 1e15;  // positions are limited to ± this

/// Limits of the motion, all above 0; a jerk of `unlimited` gives trapezoidal profiles.
struct Limits {
    double velocity = 1.0;
    double acceleration = 1.0;
    double deceleration = 1.0;
    double jerk = unlimited;
    bool operator==(const Limits&) const = default;

    /// Limits user values to the range without overflow: a deceleration of 0 is the acceleration, a
    /// jerk of 0 unlimited. False if a value is invalid. [realtime]
    static bool from(double velocity, double acceleration, double deceleration, double jerk,
                     Limits& to) noexcept {
        if (!(velocity > 0.0 && acceleration > 0.0 && deceleration >= 0.0 && jerk >= 0.0)) {
            return false;
        }
        const auto sane = [](double x) { return std::clamp(x, 1e-18, 1e18); };
        to = {sane(velocity), sane(acceleration),
              sane(deceleration > 0.0 ? deceleration : acceleration),
              jerk > 0.0 && jerk < 1e24 ? std::max(jerk, 1e-18) : unlimited};
        return true;
    }
};

struct State {
    double position = 0.0;
    double velocity = 0.0;
    double acceleration = 0.0;

    State after(double t, double jerk) const noexcept {
        return {position + t * (velocity + t * (acceleration / 2 + t * jerk / 6)),
                velocity + t * (acceleration + t * jerk / 2), acceleration + t * jerk};
    }
    State mirrored() const noexcept { return {-position, -velocity, -acceleration}; }
};

/// A sequence of segments of constant jerk, built from its start.
class Path {
public:
    Path() = default;
    Path(const State& start, double jerk) noexcept : end_(start), jerk_(jerk) {}

    const State& end() const noexcept { return end_; }
    double duration() const noexcept { return duration_; }

    void cruise(double time) noexcept {
        end_.acceleration = 0.0;
        append(time, 0.0);
    }
    /// Changes the acceleration to `a`.
    void ramp(double a) noexcept {
        if (jerk_ < unlimited) {
            append(std::fabs(a - end_.acceleration) / jerk_,
                   std::copysign(jerk_, a - end_.acceleration));
        }
        end_.acceleration = a;
    }
    /// Changes the speed to `v`, with an acceleration of 0 there, with accelerations within
    /// ±`max`; an initial acceleration beyond it returns to it immediately.
    void reach(double v, double max) noexcept {
        if (!(jerk_ < unlimited)) {
            end_.acceleration = std::copysign(max, v - end_.velocity);
            append(std::fabs(v - end_.velocity) / max, 0.0);
        } else {
            const double up = v < settled() ? -1.0 : 1.0;
            const double a = up * end_.acceleration;
            const double dv = up * (v - end_.velocity);
            const double peak = std::sqrt(std::max(0.0, jerk_ * dv + a * a / 2));
            if (peak <= max) {
                ramp(up * std::max(peak, a));
            } else {
                const double way_up =
                    (a <= max ? max * max - a * a : a * a - max * max) / (2 * jerk_);
                ramp(up * max);
                append(std::max(0.0, dv - way_up - max * max / (2 * jerk_)) / max, 0.0);
            }
            ramp(0.0);
        }
        end_.velocity = v;
        end_.acceleration = 0.0;
    }
    /// Returns the speed after the acceleration has faded out.
    double settled() const noexcept {
        if (!(jerk_ < unlimited)) return end_.velocity;
        return end_.velocity + end_.acceleration * std::fabs(end_.acceleration) / (2 * jerk_);
    }
    void mirror() noexcept {
        for (std::size_t i = 0; i < used_; ++i) {
            segments_[i] = {segments_[i].begin, segments_[i].start.mirrored(), -segments_[i].jerk};
        }
        end_ = end_.mirrored();
    }
    /// Sets the end exactly, without rounding errors.
    void settle_at(double position) noexcept { end_.position = position; }

    /// Returns the state `time` after the start, and the jerk there; after the end it continues
    /// with the end's speed.
    State at(double time, double& jerk) const noexcept {
        jerk = 0.0;
        if (time >= duration_) {
            return {end_.position + end_.velocity * (time - duration_), end_.velocity,
                    end_.acceleration};
        }
        std::size_t i = used_ - 1;
        while (i > 0 && segments_[i].begin > time) {
            --i;
        }
        jerk = segments_[i].jerk;
        return segments_[i].start.after(time - segments_[i].begin, jerk);
    }

private:
    struct Segment {
        double begin;
        State start;
        double jerk;
    };
    void append(double time, double jerk) noexcept {
        if (!(time > 0.0) || used_ == segments_.size()) return;
        segments_[used_++] = {duration_, end_, jerk};
        end_ = end_.after(time, jerk);
        duration_ += time;
    }
    // two changes of speed of three, a cruise, a stop of three, one to spare
    std::array<Segment, 12> segments_{};
    std::size_t used_ = 0;
    State end_{};
    double duration_ = 0.0;
    double jerk_ = unlimited;
};

namespace detail {
/// Returns where `f` changes its sign between `low` (f <= 0) and `high` (f >= 0), on the side of
/// `low`: T. R. Chandrupatla, *A new hybrid quadratic/bisection algorithm*, Advances in Engineering
/// Software 28 (1997), to the last bits. Between ends of different order of magnitude it bisects
/// the exponents. [realtime]
template <class F>
double root(double low, double high, double f_low, double f_high, F f) noexcept {
    double a = high;
    double b = low;
    double fa = f_high;
    double fb = f_low;
    double c = a;
    double fc = fa;
    double share = 0.5;
    for (int i = 0; i < 120; ++i) {
        const bool orders = a * b > 0.0 && std::max(a / b, b / a) > 100.0;
        const double x = orders
                             ? std::copysign(std::sqrt(std::fabs(a)) * std::sqrt(std::fabs(b)), a)
                             : a + share * (b - a);

        const double fx = f(x);
        if ((fx < 0.0) == (fa < 0.0)) {
            c = a;
            fc = fa;
        } else {
            c = b;
            fc = fb;
            b = a;
            fb = fa;
        }
        a = x;
        fa = fx;
        const double tolerance = 2e-16 * std::fabs(std::fabs(fa) < std::fabs(fb) ? a : b) + 1e-300;
        if (fa == 0.0 || std::fabs(b - a) <= 2 * tolerance) break;
        const double xi = (a - b) / (c - b);
        const double phi = (fa - fb) / (fc - fb);
        share = 0.5;
        if (phi * phi < xi && (1 - phi) * (1 - phi) < 1 - xi) {
            share = fa / (fb - fa) * fc / (fb - fc) +
                    (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb);
        }
        const double edge = tolerance / std::fabs(b - a);
        share = std::clamp(share, edge, 1 - edge);
    }
    return fa <= 0.0 ? a : b;
}

/// How a change of speed crosses 0 if the limits on its two sides differ: with the smaller one
/// throughout, or with each of them to and from a momentary stop. Neither is always the faster.
enum class Crossing { through, over_rest };

/// Continues `path` to the speed `v` (not negative).
inline void to_speed(Path& path, double v, const Limits& limits, Crossing crossing) noexcept {
    const double now = path.end().velocity;
    const double settled = path.settled();
    if (settled > v || v == 0.0) {
        return path.reach(v, limits.deceleration);  // slower, or to a stop
    }
    if (std::min(now, settled) >= 0.0) return path.reach(v, limits.acceleration);
    if (crossing == Crossing::through || settled >= 0.0) {
        return path.reach(v, std::min(limits.acceleration, limits.deceleration));
    }
    path.reach(0.0, limits.deceleration);
    path.reach(v, limits.acceleration);
}

inline Path stop(const State& start, const Limits& limits) noexcept {
    Path path(start, limits.jerk);
    path.reach(0.0, limits.deceleration);
    return path;
}

inline Path over(const State& start, double w, double cruise, const Limits& limits,
                 Crossing crossing) noexcept {
    Path path(start, limits.jerk);
    to_speed(path, w, limits, crossing);
    path.cruise(cruise);
    path.reach(0.0, limits.deceleration);
    return path;
}

/// Returns the path to a stop at `target`, which is behind the point of an immediate stop (in
/// positive direction).
inline Path forward(const State& start, double target, const Limits& limits,
                    Crossing crossing) noexcept {
    const auto miss = [&](double w) {
        return over(start, w, 0.0, limits, crossing).end().position - target;
    };
    constexpr double slowest = 1e-60;
    const double settled = Path(start, limits.jerk).settled();
    const double top = limits.velocity;
    // If the resolution of the speed is too coarse, the remaining distance is covered at that
    // speed.
    const auto by_way_of = [&](double w) {
        const double left = -miss(w);

        const double rounding = 1e-13 * (std::fabs(start.position) + std::fabs(target));
        return over(start, w, left > rounding ? left / w : 0.0, limits, crossing);
    };
    const double beyond = miss(top);
    if (beyond <= 0.0) return over(start, top, -beyond / top, limits, crossing);
    if (settled >= 0.0 && settled <= top) {
        const double at_settled = miss(settled);
        if (at_settled > 0.0) {  // only while braking: brake less for a moment
            const auto easing = [&](double a) {
                Path path(start, limits.jerk);
                path.ramp(a);
                path.reach(0.0, limits.deceleration);
                return path;
            };
            // rounding: it is the stop itself
            if (!(start.acceleration < 0.0)) return stop(start, limits);
            const double a =
                root(start.acceleration, 0.0, easing(start.acceleration).end().position - target,
                     at_settled, [&](double x) { return easing(x).end().position - target; });
            return easing(a);
        }
        return by_way_of(root(std::max(settled, slowest), top, at_settled, beyond, miss));
    }
    // From a start that is too fast S has a local maximum, but it starts at the stop point, before
    // the target, and ends behind it.
    const double min = miss(slowest);
    if (min >= 0.0) return stop(start, limits);
    return by_way_of(root(slowest, top, min, beyond, miss));
}

inline bool same(double a, double b, double scale) noexcept {
    return std::fabs(a - b) <= 4e-15 * (std::fabs(a) + std::fabs(b) + scale);
}
}  // namespace detail

/// Returns the fastest path from `start` to a stop at `target`. If the start is beyond a limit, the
/// path returns within it first, as fast as the other limits allow. [realtime]
inline Path path_to_position(const State& start, double target, const Limits& limits) noexcept {
    const Path stop = detail::stop(start, limits);
    Path best = stop;
    if (!detail::same(stop.end().position, target, std::fabs(start.position))) {
        const bool back = target < stop.end().position;
        const State from = back ? start.mirrored() : start;
        const double to = back ? -target : target;
        best = detail::forward(from, to, limits, detail::Crossing::through);
        if (limits.acceleration != limits.deceleration || !(limits.jerk < unlimited)) {
            const Path other = detail::forward(from, to, limits, detail::Crossing::over_rest);
            if (other.duration() < best.duration()) {
                best = other;
            }
        }
        if (back) {
            best.mirror();
        }
    }
    best.settle_at(target);
    return best;
}

/// Returns the fastest change of speed from `start` to `velocity`. [realtime]
inline Path path_to_velocity(const State& start, double velocity, const Limits& limits) noexcept {
    const bool back = velocity < 0.0;
    const State from = back ? start.mirrored() : start;
    const double to = std::min(std::fabs(velocity), limits.velocity);
    Path best(from, limits.jerk), other(from, limits.jerk);
    detail::to_speed(best, to, limits, detail::Crossing::through);
    detail::to_speed(other, to, limits, detail::Crossing::over_rest);
    if (other.duration() < best.duration()) {
        best = other;
    }
    if (back) {
        best.mirror();
    }
    return best;
}

/// A moving point: follows a path that is planned again after each change of the target or the
/// limits.
class Generator {
public:
    const State& state() const noexcept { return state_; }
    double jerk() const noexcept { return jerk_; }
    /// Returns the position at the end of the path.
    double end_position() const noexcept { return path_.end().position; }
    double time_left() const noexcept { return std::max(0.0, path_.duration() - time_); }
    /// True after the end of the path.
    bool arrived() const noexcept { return time_ >= path_.duration(); }
    bool moving() const noexcept { return state_.velocity != 0.0 || state_.acceleration != 0.0; }

    void put(double position) noexcept {
        state_ = {std::clamp(position, -farthest, farthest), 0.0, 0.0};
        path_ = Path(state_, unlimited);
        time_ = jerk_ = 0.0;
        kind_ = Kind::none;
    }
    void go_to(double position, const Limits& limits) noexcept {
        if (kind_ == Kind::position && position == wanted_ && limits == limits_) return;
        begin(Kind::position, position, limits, path_to_position(state_, position, limits));
    }
    void go_at(double velocity, const Limits& limits) noexcept {
        if (kind_ == Kind::velocity && velocity == wanted_ && limits == limits_) return;
        begin(Kind::velocity, velocity, limits, path_to_velocity(state_, velocity, limits));
    }
    void advance(double seconds) noexcept {
        time_ += seconds;
        // A path of a whole number of periods ends in its last one, regardless of the rounding of
        // the sum.
        if (std::fabs(path_.duration() - time_) < 1e-6 * seconds) {
            time_ = path_.duration();
        }
        const State next = path_.at(time_, jerk_);
        if (std::isfinite(next.position + next.velocity + next.acceleration) &&
            std::fabs(next.position) <= farthest) {
            state_ = next;
        } else {
            put(state_.position);
        }
    }

private:
    enum class Kind { none, position, velocity };
    void begin(Kind kind, double wanted, const Limits& limits, const Path& path) noexcept {
        kind_ = kind;
        wanted_ = wanted;
        limits_ = limits;
        path_ = path;
        time_ = 0.0;
    }
    State state_{};
    Path path_{};
    double time_ = 0.0;
    double jerk_ = 0.0;
    double wanted_ = 0.0;
    Kind kind_ = Kind::none;
    Limits limits_{};
};

}  // namespace motion
