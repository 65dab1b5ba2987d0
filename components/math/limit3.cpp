// SPDX-License-Identifier: MIT
// In one cycle `out` moves by its speed, and its speed changes by a = maxa * T^2 at most. So before
// it can stand on the goal its moves must shrink to 0. Counted backwards from the stop, in units of
// a, they are
//     p(0) = 0,  p(k) = p(k-1) + min(1, k/m),  and  q(k) = p(1) + ... + p(k)  is the way they cover,
// with m = 1 for the fastest stop; with a larger m braking fades out over the last m moves. If
// q(k-1) + t p(k) is left, 0 <= t <= 1, the move p(k-1) + t (p(k) - p(k-1)) leaves q(k-2) + t
// p(k-1): the same t and one move fewer, down to exactly 0. So the line through the points (q, p)
// is the largest speed that still stops on the goal, and braking along it never takes more than a.
// Below the line `out` speeds up. Where a whole `a` more would lead above it, it brakes by a whole
// `a`; what this leaves over is made up by the last moves, which lie on the line. That leftover
// makes one move per stop that neither speeds up nor brakes by a whole `a`; it is avoided where
// whole ones end there, too. With an input that moves at w the same holds for speed and way
// relative to it: `out` meets it at w.
#include <optional>
#include <utility>

#include "hal/component.hpp"
#include "hal/interruption.hpp"
#include "hal/limit.hpp"
#include "hal/retained.hpp"

namespace {

constexpr double max_magnitude = 1e150;  // what is larger counts as this: its square is finite
constexpr double rounding = 16e-16;  // of a few additions, relative

double bounded(double value) { return std::clamp(value, -max_magnitude, max_magnitude); }

// q(m), the distance over which braking fades out.
double fading_way(double m) { return (m + 1.0) * (m + 2.0) / 6.0; }

// p at the distance q on the line through the points (q(k), p(k)): k moves cover it.
double speed_for(double q, double m) {
    if (q <= fading_way(m)) {  // q(k) = k (k+1) (k+2) / 6m
        const double y = 6.0 * m * q * (1.0 - rounding);
        double k = std::floor(std::cbrt(y));
        if (k * (k + 1.0) * (k + 2.0) < y) {
            k += 1.0;
        }
        return 2.0 * q / (k + 1.0) + k * (k - 1.0) / (6.0 * m);
    }
    // q(m+j) = q(m) + j p(m) + j (j+1) / 2
    const double p = (m + 1.0) / 2.0;
    const double way = q - fading_way(m);
    const double b = m + 2.0;
    const double j =
        std::max(1.0, std::ceil(4.0 * way / (b + std::sqrt(b * b + 8.0 * way)) * (1.0 - rounding)));
    return p + (j - 1.0) + (way - (j - 1.0) * (p + j / 2.0)) / (p + j);
}

// The largest speed that stops at the end of `way`, which may be negative. The last move covers all
// of it.
double stopping_speed(double way, double a, double m) {
    return std::abs(way) * m <= a ? way : std::copysign(a * speed_for(std::abs(way) / a, m), way);
}

// False when a stop from `speed` surely fits into `way`: it takes (speed + a/2)^2 / 2a at most.
// Saves the root.
bool too_fast(double speed, double way, double a) {
    const double s = speed + a / 2.0;
    return speed > way || (speed > 0.0 && s * s > 2.0 * a * way);
}

// True when after a move of `speed` at most `moves` more, each faster or slower by a whole `a` than
// the one before, lead to where the last one can end the way: it is of at most `a` and within `a`
// of the one before. None leads beyond the end or back.
bool lands(double way, double speed, double a, int moves) {
    const double slack = 1e-9 * a;
    way -= speed;
    if (speed < -slack || way < -slack) return false;
    if (way <= a + slack && std::abs(way - speed) <= a + slack) return true;
    return moves > 0 &&
           (lands(way, speed - a, a, moves - 1) || lands(way, speed + a, a, moves - 1));
}

// The speed after `before`, to go `way` by at most `max_speed` in a cycle; speeds and way are
// relative to the goal, which may be moving.
double next_speed(double way, double before, double max_speed, double a, double m,
                  bool moving = false) {
    const double side = std::copysign(1.0, way);
    const double limit = side * stopping_speed(way, a, m);

    const double on_line = std::min(limit, max_speed);
    const double faster = side * before + a;
    const double slower = side * before - a;

    const double fastest = std::min(faster, max_speed);
    const double last_moves = a * (fading_way(m) + m + 4.0);  // q(m+2)
    if (side * way - std::clamp(on_line, slower, faster) <= last_moves) {
        // With a whole `a` in each cycle, when such moves end there as soon, or meet a moving goal
        // at most two cycles later.
        const int moves_on_line =
            static_cast<int>(std::min(8.0, std::ceil(on_line / a - rounding)));
        if (m == 1.0 && limit < max_speed && on_line > slower && on_line < faster &&
            side * way > a) {
            for (int moves = 0; moves <= moves_on_line + (moving ? 0 : -2); ++moves) {
                for (const double speed : {slower, faster}) {
                    if (speed <= max_speed && lands(side * way, speed, a, moves))
                        return side * speed;
                }
            }
        }
        return side * on_line;
    }
    return side * (fastest <= limit * (1.0 + rounding) ? fastest : slower);
}

struct Limit3 : hal::Component {
    using Component::Component;
    hal::In<double> in{*this, "in", "target value"};
    hal::Out<double> out{*this, "out", "follows in, within the limits"};
    hal::In<bool> enable{*this,
                         "enable",
                         "TRUE: out follows in; FALSE: out returns to 0 within the limits",
                         {.initial = true}};
    hal::In<bool> load{
        *this, "load",
        "TRUE sets out to in immediately, to 0 while enable is FALSE, regardless of maxv "
        "and maxa"};
    hal::Limit min{*this, "min", "lowest output", {.initial = -1e20}};
    hal::Limit max{*this, "max", "highest output", {.initial = 1e20}};
    hal::Limit maxv{*this, "maxv", "largest first derivative of out", {.initial = 1e20}};
    hal::Limit maxa{*this, "maxa", "largest second derivative of out", {.initial = 1e20}};
    hal::In<std::uint32_t> smooth_steps{
        *this,
        "smooth-steps",
        "cycles before a stop in which acceleration fades out; 2: the fastest stop",
        {.initial = 2}};
    hal::Function run{*this, "", hal::step<&Limit3::update>, "follows in"};

    void update(hal::Cycle cycle) noexcept {
        const double period = cycle.seconds();
        const double a = std::min(maxa * period * period, max_magnitude),
                     v = maxv > 0.0 ? std::min(maxv * period, max_magnitude) : 0.0;
        const double speed = look_at_input();
        if (interruption_.accept()) {
            stand();
        }
        if (load) {
            carry(a, std::clamp(speed, -v, v));
        } else if (a > 1.0 / max_magnitude) {
            approach(a, v, current_target(speed_to_meet(speed, v)));
        } else {
            stand();
        }
        out = position_;
    }

private:
    // Reads in, min and max; a NaN input keeps the last value. Returns the speed of the input: the
    // smaller of its last two, because a step or a jitter has a speed in one cycle and none or the
    // opposite in the next.
    double look_at_input() noexcept {
        const double input = in;
        const double before = speed_in_;
        high_ = bounded(max);
        low_now_ = std::min(bounded(min), high_);
        speed_in_ = std::isnan(input) ? 0.0 : bounded(input) - input_;
        if (!std::isnan(input)) {
            input_ = bounded(input);
        }
        return speed_in_ > 0.0 ? std::max(0.0, std::min(speed_in_, before))
                               : std::min(0.0, std::max(speed_in_, before));
    }

    // An input faster than maxv cannot be met and counts as stationary.
    double speed_to_meet(double w, double v) const noexcept {
        return std::abs(w) <= v * (1.0 + 1e-9) + 8.0 * rounding * std::abs(input_)
                   ? std::clamp(w, -v, v)
                   : 0.0;
    }

    // Keeps the speed of the input for the cycle after load, as far as a stop from it fits between
    // min and max. A step has no speed.
    void carry(double a, double input_speed) noexcept {
        position_ = std::clamp(enable ? input_ : 0.0, low_now_, high_);
        rest_ = 0.0;
        arrived_ = true;
        speed_ = 0.0;
        if (enable && position_ == input_ && a > 1.0 / max_magnitude) {
            speed_ = std::clamp(input_speed, stopping_speed(low_now_ - position_, a, 1.0),
                                stopping_speed(high_ - position_, a, 1.0));
        }
    }

    void stand() noexcept {
        speed_ = 0.0;
        arrived_ = false;
    }

    /// Where out is to go in this cycle. Distances are measured from out, positive upwards.
    struct Target {
        double position;
        double speed;  ///< of the target itself: out meets it at this speed
        double distance;
        double down, up;  ///< to the lower limit: <= 0 within the range; to the upper one: >= 0
    };

    Target current_target(double input_speed) const noexcept {
        const double position = std::clamp(enable ? input_ : 0.0, low_now_, high_);
        const bool follows_input = enable && position == input_;
        return {position, follows_input ? input_speed : 0.0, distance_to(position),
                distance_to(low_now_), distance_to(high_)};
    }

    /// Moves out for one cycle: the speed that meets the target, reduced until a stop from it fits
    /// into the range and to `v`, as far as `a` allows. A distance that remains by rounding only is
    /// dropped: out ends exactly on the target or on a limit.
    void approach(double a, double v, const Target& target) noexcept {
        const double wanted =
            std::clamp(within_range(meeting_speed(target, a, v), target, a, v), -v, v);
        const double possible = std::clamp(wanted, speed_ - a, speed_ + a);
        const double slack = 1e-12 * a + rounding * (std::abs(speed_) + std::abs(target.speed));
        speed_ = std::abs(wanted - possible) <= slack ? wanted : possible;
        move(speed_);
        arrived_ = reaches(target, a);
        if (arrived_) {
            stand_at(target.position);
        } else if (const auto limit = limit_passed_by_rounding(target, slack)) {
            stand_at(*limit);
        }
    }

    /// Returns the speed that meets the target, whatever the range. Ahead of a moving target out
    /// may be faster than it by v less its speed only.
    double meeting_speed(const Target& target, double a, double v) const noexcept {
        const double w = target.speed;
        const double distance = target.distance - w;  // after this cycle, at standstill
        const double max_relative_speed = target.distance < w ? v + w : v - w;
        // Once on the input it need not be gentle to what the input does within the limits.
        const bool is_on_input = arrived_ && std::abs(distance) <= a;
        const double m = is_on_input ? 1.0 : std::max<double>(smooth_steps, 2.0) - 1.0;
        return w + next_speed(distance, speed_ - w, max_relative_speed, a, m, w != 0.0);
    }

    /// Returns the speed, or the one nearest to it from which out stops within the range. From
    /// outside of the range it returns to the limit that it has passed.
    double within_range(double speed, const Target& target, double a, double v) const noexcept {
        const auto [down, up] = std::pair(target.down, target.up);
        if (too_fast(-speed, -down, a)) {
            speed = std::max(speed, down < 0.0 ? next_speed(down, speed_, v, a, 1.0)
                                               : stopping_speed(down, a, 1.0));
        }
        if (too_fast(speed, up, a)) {
            speed = std::min(
                speed, up > 0.0 ? next_speed(up, speed_, v, a, 1.0) : stopping_speed(up, a, 1.0));
        }
        return speed;
    }

    /// Whether the move just made ended on the target, at its speed.
    bool reaches(const Target& target, double a) const noexcept {
        const double tiny = rounding * (std::abs(target.position) + std::abs(speed_));
        return std::abs(target.distance - speed_) <= tiny &&
               std::abs(speed_ - target.speed) <= a + tiny;
    }

    /// Returns the limit that the move just made passed by at most `slack`, if it did.
    std::optional<double> limit_passed_by_rounding(const Target& target,
                                                   double slack) const noexcept {
        if (target.up >= 0.0 && speed_ > target.up && speed_ - target.up <= slack) return high_;
        if (target.down <= 0.0 && speed_ < target.down && target.down - speed_ <= slack) {
            return low_now_;
        }
        return std::nullopt;
    }

    double distance_to(double position) const noexcept { return (position - position_) - rest_; }
    void stand_at(double position) noexcept {
        position_ = position;
        rest_ = 0.0;
    }
    // Adds to the position and keeps the rounding error of the sum, so that stops after a long
    // distance are exact.
    void move(double by) noexcept {
        by += rest_;
        const double sum = position_ + by;
        const double part = sum - position_;
        rest_ = (position_ - (sum - part)) + (by - part);
        position_ = sum;
    }

    double position_ = 0.0;
    double rest_ = 0.0;  // out and its rounding error
    double speed_ = 0.0;  // of out, per cycle like all speeds here
    double input_ = 0.0;
    double speed_in_ = 0.0;  // last valid in, and its speed
    double high_ = 0.0;
    double low_now_ = 0.0;  // max; the lower of min and max
    bool arrived_ = true;  // out is on its goal
    hal::Interruption interruption_{*this};
    hal::Retained retained_{*this,
                            {{"position", position_},
                             {"rest", rest_},
                             {"speed", speed_},
                             {"input", input_},
                             {"speed-in", speed_in_},
                             {"high", high_},
                             {"low-now", low_now_},
                             {"arrived", arrived_},
                             {"interruption", interruption_}}};
};

}  // namespace

HAL_COMPONENT(Limit3, "limit3",
              "Follows a value within limits of position, velocity and acceleration", R"(
`out` moves to `in` as fast as `min`, `max`, `maxv` and `maxa` allow, and stops there without
overshoot; it meets a moving input at the input's speed, and follows an input within the limits
without lag. It brakes in time for `min` and `max`. If a limit moves or the input reverses so that
the output can no longer stop in time, the output overshoots within `maxa` and returns. It uses the
full `maxa` or the full `maxv` until a few cycles before a stop. With `smooth-steps` above 2 the
acceleration fades out over that many cycles: this takes slightly longer and is smoother with a
jittering input.

`out` starts at 0, and after a stop of the thread from rest; `load` sets it to the input, or to 0
while `enable` is FALSE. While the input or a limit is NaN its last valid value applies; for a limit
a fault is raised. If `maxa` is not
positive, `out` does not move. If `min` is above `max`, `max` applies.

**Differences from LinuxCNC:** acceleration and cruising are the same. Halcyon's `limit3` stops with
`maxa` exactly at the target (LinuxCNC halves the remaining distance in each of about 30 last
cycles), respects `min` and `max` also with the default `maxv` and `maxa` (LinuxCNC exceeds them),
leaves `min` and `max` together with the input (LinuxCNC a few cycles earlier, to match its speed),
brakes towards an input that approaches faster than `maxv` (LinuxCNC reverses), and leaves `load`
within `maxa`, with the speed of the input as far as `maxv`, and a stop within `min` and `max`,
allow it (LinuxCNC within `maxv` only).

    loadrt limit3 names=jog
    addf jog servo
    setp jog.maxv 50
    setp jog.maxa 400
    net jog-target   => jog.in
    net jog-position <= jog.out
)")
