// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "hal/component.hpp"
#include "hal/limit.hpp"
#include "hal/retained.hpp"
#include "mobile/to_target.hpp"

namespace {

constexpr std::size_t sensors = 16;
constexpr double pi = std::numbers::pi;

struct DriveAround : hal::Component {
    using Component::Component;

    hal::mobile::ToTarget go{*this, {0.05, "distance within which the target is reached"}};

    hal::Ins<std::uint32_t> reading{*this, "reading-##", sensors,
                                    "reading of sensor ## of the infrared ring, 0..4095"};
    hal::In<double> echo_range{*this,
                               "echo-range",
                               "distance from the centre of what the ultrasonic head has found",
                               {.initial = 1000.0, .unit = "m"}};
    hal::In<double> echo_bearing{
        *this, "echo-bearing", "its direction, to the left of the heading", {.unit = "rad"}};
    hal::In<std::uint32_t> echo_count{*this, "echo-count",
                                      "a new value: echo-range and echo-bearing are new"};
    hal::Param<double> constant{
        *this, "constant", "reading times the square of distance + offset", {.initial = 40.0}};
    hal::Param<double> offset{
        *this, "offset", "offset of the distance", {.initial = 0.05, .unit = "m"}};
    hal::Param<double> apothem{*this,
                               "apothem",
                               "distance of the sensors from the centre",
                               {.initial = 0.22, .unit = "m"}};
    hal::Param<double> spread{*this,
                              "spread",
                              "distance of the two sensors of a side from its middle",
                              {.initial = 0.045, .unit = "m"}};
    hal::Param<double> body{
        *this, "body-radius", "radius of the robot with a margin", {.initial = 0.32, .unit = "m"}};
    hal::Param<double> horizon{*this,
                               "horizon",
                               "obstacles farther from the centre do not matter",
                               {.initial = 0.85, .unit = "m"}};
    hal::Param<double> memory{
        *this, "memory", "time for which an obstacle is remembered", {.initial = 3.0, .unit = "s"}};
    hal::Param<double> heading_gain{*this,
                                    "heading-gain",
                                    "turning speed per angle to the chosen direction",
                                    {.initial = 3.0, .unit = "1/s"}};
    hal::LimitParam max_turn{
        *this, "max-turn", "maximum turning speed", {.initial = 1.5, .unit = "rad/s"}};

    hal::Out<double> nearest{
        *this,
        "nearest",
        "distance of the nearest obstacle of the infrared ring from the centre; 1000: none",
        {.unit = "m", .finite = true}};
    hal::Out<double> direction{*this,
                               "direction",
                               "chosen direction, relative to the heading",
                               {.unit = "rad", .finite = true}};
    hal::Out<bool> avoiding{*this, "avoiding", "TRUE: the direct way is not free"};
    hal::Out<bool> blocked{*this, "blocked",
                           "TRUE: no direction is free; the robot turns on the spot"};

    hal::Function run{*this, "update", &DriveAround::update, "chooses a direction and the speeds"};

    void update(hal::Cycle cycle) noexcept {
        if (!go.valid()) return rest();
        look(cycle.start_ns());
        if (!go.under_way(1.0)) return rest();
        const double chosen = choose(go.wanted(), go.left());
        // Space in front: no faster than the robot can stop within it.
        const double free_space = std::clamp((free_ahead() - body) * 2.0, 0.0, 1.0);
        const double slowed = go.speed(direction) *
                              (avoiding ? std::fmax(free_space, 0.15) : std::fmax(free_space, 0.3));
        go.linear = blocked ? 0.0 : go.finite(std::fmax(slowed, 0.0));
        go.angular =
            go.finite(std::clamp(heading_gain * chosen, -std::fabs(max_turn), std::fabs(max_turn)));
    }

private:
    static constexpr int sectors = 72;  // 5 degrees each
    static constexpr std::int64_t never = INT64_MIN;
    static constexpr double no_obstacle = 1000.0;  // value of `nearest`, m
    struct Point {
        double x = 0.0;
        double y = 0.0;
        std::int64_t at_ns = never;
    };
    struct Obstacle {
        double angle, distance;  // from the centre, relative to the heading
    };

    void rest() noexcept {
        direction = 0.0;
        avoiding = false;
        blocked = false;
        last_ = 0.0;
    }
    /// Updates `seen_`: where the sensors report something, or did so a short time ago, because an
    /// obstacle beside the robot may be between two of them. Sets `nearest`.
    void look(std::int64_t now) noexcept {
        look_at_ring(now);
        look_at_echo(now);
        see_remembered(now);
    }
    /// Remembers what the infrared ring reports within the horizon.
    void look_at_ring(std::int64_t now) noexcept {
        double min = no_obstacle;
        for (std::size_t i = 0; i < sensors; ++i) {
            const std::optional<double> range = range_of(reading[i]);
            if (!range) continue;
            // where the beam ends, from the centre: sideways, and outwards through the side
            const double aside = i % 2 == 0 ? -spread : spread.get();
            const double out = apothem + std::fmax(*range, 0.0);
            const double distance = std::hypot(out, aside);
            min = std::fmin(min, distance);
            if (distance < horizon) {
                const double facing = static_cast<double>(i / 2) * pi / 4;
                remember(distance, facing + std::atan2(aside, out), now);
            }
        }
        nearest = go.finite(min);
    }
    /// Returns the distance from a sensor of the ring to what it sees; nothing within its range.
    std::optional<double> range_of(std::uint32_t value) const noexcept {
        constexpr double max_range_m = 10.0;
        if (value == 0) return std::nullopt;
        const double range = std::sqrt(std::fmax(constant, 0.0) / value) - offset;
        return range < max_range_m ? std::optional(range) : std::nullopt;
    }
    /// Remembers a new echo of the ultrasonic head within the horizon.
    void look_at_echo(std::int64_t now) noexcept {
        if (echo_count == echoes_) return;
        echoes_ = echo_count;
        if (echo_range > 0.0 && echo_range < horizon && std::isfinite(echo_bearing)) {
            remember(echo_range, echo_bearing, now);
        }
    }
    /// Lists in `seen_` the points that are recent and within the horizon from the pose of now.
    void see_remembered(std::int64_t now) noexcept {
        count_ = 0;
        for (const Point& p : points_) {
            if (p.at_ns == never) continue;
            const double age_s = 1e-9 * static_cast<double>(now - p.at_ns);
            const double distance = std::hypot(p.x - go.x, p.y - go.y);
            if (age_s <= memory && distance < horizon) {
                const double bearing = std::atan2(p.y - go.y, p.x - go.x) - go.heading;
                seen_[count_++] = {bearing, distance};
            }
        }
    }
    /// A point that is nearly known is renewed; another one replaces the oldest.
    void remember(double at, double bearing, std::int64_t now) noexcept {
        constexpr double same_m = 0.05;
        const Point seen{go.x + at * std::cos(go.heading + bearing),
                         go.y + at * std::sin(go.heading + bearing), now};
        Point* oldest = points_.data();
        for (Point& p : points_) {
            if (p.at_ns != never && std::hypot(p.x - seen.x, p.y - seen.y) < same_m) {
                p.at_ns = seen.at_ns;
                return;
            }
            if (p.at_ns < oldest->at_ns) {
                oldest = &p;
            }
        }
        *oldest = seen;
    }
    double free_ahead() const noexcept {
        double min = horizon;
        for (std::size_t i = 0; i < count_; ++i) {  // what is in the lane of the body
            const double ahead = seen_[i].distance * std::cos(seen_[i].angle);

            const double aside = seen_[i].distance * std::sin(seen_[i].angle);
            if (ahead > 0.0 && std::fabs(aside) < 0.85 * body) {
                min = std::fmin(min, ahead);
            }
        }
        return min;
    }
    bool is_free(double angle, double left) const noexcept {
        for (std::size_t i = 0; i < count_; ++i) {
            const Obstacle& o = seen_[i];
            if (o.distance - body > left) {
                continue;  // behind the target
            }
            const double half = o.distance > body ? std::asin(body / o.distance) : pi / 2;
            if (std::fabs(std::remainder(o.angle - angle, 2 * pi)) < half) return false;
        }
        return true;
    }
    /// The free direction with the least cost: away from the target, and away from the direction
    /// chosen before, in the room (J. Borenstein, Y. Koren, *The vector field histogram*, IEEE
    /// Transactions on Robotics and Automation 7, 1991; the cost is that of I. Ulrich's VFH+,
    /// 1998).
    double choose(double wanted, double left) noexcept {
        const double before = std::remainder(last_ - go.heading, 2 * pi);
        if (is_free(wanted, left)) {
            avoiding = false;
            blocked = false;
            direction = wanted;
            last_ = go.heading + wanted;
            return wanted;
        }
        double best = 0.0;
        double min = 1e9;
        for (int i = 0; i < sectors; ++i) {
            const double angle = std::remainder(i * 2 * pi / sectors, 2 * pi);
            if (!is_free(angle, left)) continue;
            const double cost =
                2.0 * std::fabs(std::remainder(angle - wanted, 2 * pi)) +
                1.5 * (avoiding ? std::fabs(std::remainder(angle - before, 2 * pi)) : 0.0) +
                0.3 * std::fabs(angle);
            if (cost < min) {
                min = cost;
                best = angle;
            }
        }
        blocked = min > 1e8;
        avoiding = true;
        direction = blocked ? 0.0 : best;
        if (!blocked) {
            last_ = go.heading + best;
        }
        return blocked ? pi / 4 : best;
    }

    std::array<Point, 192> points_{};
    std::array<Obstacle, 192> seen_{};
    std::size_t count_ = 0;
    double last_ = 0.0;
    std::uint32_t echoes_ = 0;
    hal::Retained retained_{*this,
                            {{"points", points_},
                             {"seen", seen_},
                             {"count", count_},
                             {"last", last_},
                             {"echoes", echoes_}}};
};

}  // namespace

HAL_COMPONENT(DriveAround, "drive_around",
              "Drives a two-wheeled robot to a point, around obstacles", R"(
Computes the speeds for `diff_drive` from pose, target and the readings of a ring of 16 infrared
sensors: an octagon with two sensors per side, side 1 forwards, counted to the left.

    distance = sqrt(constant / reading) - offset

Each obstacle closes the directions in which the robot, with `body-radius`, would touch it; of the
free ones the robot takes the one nearest to the target, and nearest to the one it took before
(vector field histogram: J. Borenstein, Y. Koren, IEEE Transactions on Robotics and Automation 7,
1991). It drives slower towards what is near. An ultrasonic head (`echo_range`) adds what the ring
does not see: each new value of `echo-count` is an echo at `echo-range` and `echo-bearing`. An
obstacle is remembered for `memory`, because what is beside the robot may be between two sensors.
There is no map beyond that: a dead end deeper than the range of the sensors can hold it, and
`blocked` or a long time without `reached` is for the program above.

    loadrt drive_around names=pilot
    loadrt diff_drive names=base
    addf base.odometry servo
    addf pilot.update servo
    addf base.command servo
    net x       base.x       => pilot.x
    net y       base.y       => pilot.y
    net heading base.heading => pilot.heading
    net front   => pilot.reading-00
    net ahead   pilot.linear  => base.linear
    net turn    pilot.angular => base.angular

With the head of `echo_range`:

    loadrt echo_range names=sonar
    addf sonar.update servo
    net echo-range   sonar.range   => pilot.echo-range
    net echo-bearing sonar.bearing => pilot.echo-bearing
    net echo-count   sonar.bursts  => pilot.echo-count
)")
