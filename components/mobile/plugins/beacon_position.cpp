// SPDX-License-Identifier: MIT
#include <array>
#include <cmath>
#include <numbers>

#include "hal/component.hpp"
#include "hal/retained.hpp"
#include "mobile/triangulation.hpp"

namespace {

using hal::mobile::wrapped;
constexpr std::size_t beacons = 3;

struct BeaconPosition : hal::Component {
    using Component::Component;

    hal::In<bool> fresh{*this, "new", "TRUE: a reflection arrived in this cycle"};
    hal::In<std::uint32_t> angle{*this, "angle", "its angle to the left of the heading, counts"};
    hal::In<std::uint32_t> width{*this, "width", "its width, counts"};
    hal::In<std::uint32_t> time_us{
        *this, "time", "clock of the scanner at the reflection", {.unit = "us"}};
    hal::In<double> odometry_x{*this, "odometry-x", "x by odometry; it may drift", {.unit = "m"}};
    hal::In<double> odometry_y{*this, "odometry-y", "y by odometry", {.unit = "m"}};
    hal::In<double> odometry_heading{
        *this, "odometry-heading", "heading by odometry", {.unit = "rad"}};
    hal::In<double> x{*this, "x", "estimated x, of the filter", {.unit = "m"}};
    hal::In<double> y{*this, "y", "estimated y", {.unit = "m"}};
    hal::In<double> heading{*this, "heading", "estimated heading", {.unit = "rad"}};
    hal::Ins<double> beacon_x{*this, "beacon-#-x", beacons, 1, "x of beacon #", {.unit = "m"}};
    hal::Ins<double> beacon_y{*this, "beacon-#-y", beacons, 1, "y of beacon #", {.unit = "m"}};
    hal::Param<std::uint32_t> resolution{*this, "counts", "counts of a turn", {.initial = 4096}};
    hal::Param<double> radius{
        *this, "beacon-radius", "radius of the beacons", {.initial = 0.04, .unit = "m"}};
    hal::Param<double> tolerance{*this,
                                 "width-tolerance",
                                 "largest ratio of a width and the expected one, or its inverse",
                                 {.initial = 2.0}};
    hal::Param<double> gate{*this,
                            "gate",
                            "largest difference between a bearing and the expected one",
                            {.initial = 0.17, .unit = "rad"}};
    hal::Param<double> timeout{*this,
                               "timeout",
                               "time without three accepted bearings after which lost becomes TRUE",
                               {.initial = 0.5, .unit = "s"}};
    hal::Param<double> min_d{
        *this, "min-d", "smallest |D| of a triangulation", {.initial = 0.5, .unit = "m^2"}};
    hal::Param<double> min_x{
        *this, "min-x", "smallest x of the field", {.initial = 0.0, .unit = "m"}};
    hal::Param<double> max_x{
        *this, "max-x", "largest x of the field", {.initial = 3.0, .unit = "m"}};
    hal::Param<double> min_y{
        *this, "min-y", "smallest y of the field", {.initial = 0.0, .unit = "m"}};
    hal::Param<double> max_y{
        *this, "max-y", "largest y of the field", {.initial = 2.1, .unit = "m"}};

    hal::Outs<double> bearing{
        *this,          "bearing-#", beacons, 1, "bearing of beacon #, relative to the heading",
        {.unit = "rad"}};
    hal::Outs<bool> bearing_new{*this, "bearing-#-new", beacons, 1,
                                "TRUE: bearing-# is new in this cycle"};
    hal::Out<double> age{*this, "age", "age of the bearing that is new", {.unit = "s"}};
    hal::Out<double> fix_x{*this, "fix-x", "x by triangulation", {.unit = "m", .finite = true}};
    hal::Out<double> fix_y{*this, "fix-y", "y by triangulation", {.unit = "m", .finite = true}};
    hal::Out<double> fix_heading{
        *this, "fix-heading", "heading by triangulation", {.unit = "rad", .finite = true}};
    hal::Out<double> fix_d{*this,
                           "fix-d",
                           "|D| of the triangulation: the error grows with its inverse",
                           {.unit = "m^2", .finite = true}};
    hal::Out<bool> fix_new{*this, "fix-new",
                           "TRUE: the position was lost, and fix-x, fix-y, fix-heading are it"};
    hal::Out<bool> lost{*this,
                        "lost",
                        "TRUE: bearings are not expected; the next fix is a new start",
                        {.initial = true}};
    hal::Out<std::uint32_t> used{*this, "used", "bearings assigned to a beacon"};
    hal::Out<std::uint32_t> rejected{*this, "rejected",
                                     "reflections of another width or from another direction"};
    hal::Out<std::uint32_t> degenerate{
        *this, "degenerate",
        "triangulations with |D| below min-d, or whose bearings contradict each other"};

    hal::Function run{*this, "update", &BeaconPosition::update,
                      "assigns the new reflection to a beacon"};

    void update(hal::Cycle cycle) noexcept {
        const std::int64_t now = cycle.start_ns();
        for (auto& flag : bearing_new) {
            flag = false;
        }
        fix_new = false;
        if (std::isfinite(odometry_x + odometry_y + odometry_heading)) {
            past_[number_++ % past_.size()] = {now, odometry_x, odometry_y, odometry_heading};
        }
        for (std::size_t i = 0; i < beacons; ++i) {
            if (std::isfinite(beacon_x[i] + beacon_y[i])) {
                map_[i] = {beacon_x[i], beacon_y[i]};
            }
        }
        if (fresh) {
            take(now);
        }
        bool all = true;
        for (const std::int64_t at : accepted_ns_) {
            all = all && at != never && 1e-9 * static_cast<double>(now - at) <= timeout;
        }
        lost = !all;
    }

private:
    static constexpr std::int64_t never = INT64_MIN;
    struct Pose {
        std::int64_t at_ns;
        double x, y, heading;
    };
    struct Seen {
        std::int64_t at_ns = never;
        double bearing = 0.0;
        double width = 0.0;
        Pose odometry{};
    };

    void take(std::int64_t now) noexcept {
        const double counts = std::max<std::uint32_t>(resolution, 1);
        const double full = 2 * std::numbers::pi;
        const Seen one{now - age_ns(now), wrapped((angle + 0.5) / counts * full),
                       width / counts * full, odometry_at(now - age_ns(now))};
        age = 1e-9 * static_cast<double>(now - one.at_ns);
        if (!lost) {
            const std::size_t i = nearest(one);
            if (i == beacons) {
                rejected = rejected + 1;
                return;
            }
            return assign(i, one);
        }
        for (std::size_t i = 0; i + 1 < last_.size(); ++i) {
            last_[i] = last_[i + 1];
        }
        last_.back() = one;
        locate(now);
    }
    /// The clocks of scanner and robot differ by a constant; the smallest difference seen is the
    /// one with the shortest transport.
    std::int64_t age_ns(std::int64_t now) noexcept {
        const auto late = static_cast<std::int64_t>(static_cast<std::int32_t>(
                              static_cast<std::uint32_t>(now / 1000) - time_us)) *
                          1000;
        if (!clock_known_ || late < shortest_ns_ || late > shortest_ns_ + 1'000'000'000) {
            shortest_ns_ = late;
            clock_known_ = true;
        }
        return late - shortest_ns_;
    }
    Pose odometry_at(std::int64_t at) const noexcept {
        Pose best{};
        bool any = false;
        for (std::size_t i = 0; i < std::min<std::size_t>(number_, past_.size()); ++i) {
            if (!any || std::llabs(past_[i].at_ns - at) < std::llabs(best.at_ns - at)) {
                best = past_[i];
                any = true;
            }
        }
        return best;
    }
    double expected_width(std::size_t i, double px, double py) const noexcept {
        const double distance = std::hypot(map_[i].x - px, map_[i].y - py);
        return 2 * std::asin(std::fmin(1.0, radius / std::fmax(distance, 1e-3)));
    }
    bool fits(const Seen& seen, std::size_t i, double px, double py) const noexcept {
        const double expected = expected_width(i, px, py);
        const double max = std::fmax(tolerance, 1.0);

        const double count = 2 * std::numbers::pi / std::max<std::uint32_t>(resolution, 1);
        return seen.width <= expected * max + count && seen.width + count >= expected / max;
    }
    /// The beacon in whose direction the reflection is expected; `beacons`: none.
    std::size_t nearest(const Seen& seen) const noexcept {
        std::size_t best = beacons;
        double min = gate;
        for (std::size_t i = 0; i < beacons; ++i) {
            const double off = std::fabs(
                wrapped(std::atan2(map_[i].y - y, map_[i].x - x) - heading - seen.bearing));
            if (off < min && fits(seen, i, x, y)) {
                min = off;
                best = i;
            }
        }
        return best;
    }
    /// Sum of the squared logarithms of the ratios of seen and expected widths.
    double mismatch(const std::array<std::size_t, 3>& to,
                    const hal::mobile::Fix& fix) const noexcept {
        double sum = 0.0;
        for (std::size_t i = 0; i < beacons; ++i) {
            const double ratio =
                std::log(last_[i].width / std::fmax(expected_width(to[i], fix.x, fix.y), 1e-6));
            sum += ratio * ratio;
        }
        return sum;
    }
    void assign(std::size_t i, const Seen& seen) noexcept {
        bearing[i] = seen.bearing;
        bearing_new[i] = true;
        accepted_ns_[i] = seen.at_ns;
        used = used + 1;
    }
    /// Tries the three assignments of three successive reflections; the beacons are met in the
    /// order of their angles.
    void locate(std::int64_t now) noexcept {
        if (last_[0].at_ns == never || 1e-9 * static_cast<double>(now - last_[0].at_ns) > 0.3) {
            return;
        }
        hal::mobile::Fix best;
        double min = 1e9;
        double second = 1e9;
        for (int order = 0; order < 2;
             ++order) {  // seen from outside of the triangle, they are met the other way round
            for (std::size_t shift = 0; shift < beacons; ++shift) {
                std::array<std::size_t, 3> to{};
                for (std::size_t i = 0; i < beacons; ++i) {
                    to[order == 0 ? i : beacons - 1 - i] = (i + shift) % beacons;
                }
                const hal::mobile::Fix fix = solve(to);
                if (!fix.valid) {
                    degenerate = degenerate + 1;
                    continue;
                }
                bool good = fix.x >= min_x && fix.x <= max_x && fix.y >= min_y && fix.y <= max_y;
                for (std::size_t i = 0; i < beacons; ++i) {
                    good = good && fits(last_[i], to[i], fix.x, fix.y);
                }
                if (!good) continue;
                const double wrong = mismatch(to, fix);
                second = std::fmin(second, std::fmax(wrong, min));
                if (wrong < min) {
                    min = wrong;
                    best = fix;
                }
            }
        }
        // two places explain what was seen: wait until the robot has moved or turned
        if (min > 1e8 || second < min + 0.1) return;
        const Pose at = last_[2].odometry;
        const Pose here = odometry_at(now);
        const double turn = best.heading - at.heading;
        const double c = std::cos(turn);
        const double s = std::sin(turn);
        fix_x = best.x + c * (here.x - at.x) - s * (here.y - at.y);
        fix_y = best.y + s * (here.x - at.x) + c * (here.y - at.y);
        fix_heading = wrapped(best.heading + here.heading - at.heading);
        fix_d = best.d;
        fix_new = true;
        for (auto& accepted : accepted_ns_) {
            accepted = now;
        }
        last_.fill({});
    }
    /// The pose at the newest of three reflections, which were seen from three places: two rounds
    /// correct the bearings by odometry.
    hal::mobile::Fix solve(const std::array<std::size_t, 3>& to) const noexcept {
        std::array<hal::mobile::Place, 3> places;
        std::array<double, 3> bearings{}, corrected{};
        const Pose& end = last_[2].odometry;
        for (std::size_t i = 0; i < beacons; ++i) {
            places[i] = map_[to[i]];
            bearings[i] = last_[i].bearing;
            corrected[i] = bearings[i] + last_[i].odometry.heading - end.heading;
        }
        hal::mobile::Fix fix = hal::mobile::triangulate(places, corrected, min_d);
        for (int round = 0; round < 2 && fix.valid; ++round) {
            for (std::size_t i = 0; i < beacons; ++i) {
                const Pose& then = last_[i].odometry;
                const double turn = fix.heading - end.heading;
                const double c = std::cos(turn);

                const double s = std::sin(turn);
                const double dx = then.x - end.x;
                const double dy = then.y - end.y;
                const double px = fix.x + c * dx - s * dy;
                const double py = fix.y + s * dx + c * dy;
                const double from_then = std::atan2(places[i].y - py, places[i].x - px);

                const double from_now = std::atan2(places[i].y - fix.y, places[i].x - fix.x);
                corrected[i] = bearings[i] + then.heading - end.heading + from_now - from_then;
            }
            fix = hal::mobile::triangulate(places, corrected, min_d);
        }
        return fix;
    }

    std::array<Pose, 128> past_{};
    std::array<Seen, 3> last_{};
    std::array<hal::mobile::Place, 3> map_{};
    std::array<std::int64_t, beacons> accepted_ns_{never, never, never};
    std::size_t number_ = 0;
    std::int64_t shortest_ns_ = 0;
    bool clock_known_ = false;
    hal::Retained retained_{*this,
                            {{"past", past_},
                             {"last", last_},
                             {"map", map_},
                             {"accepted-ns", accepted_ns_},
                             {"number", number_},
                             {"shortest-ns", shortest_ns_},
                             {"clock-known", clock_known_}}};
};

}  // namespace

HAL_COMPONENT(BeaconPosition, "beacon_position",
              "Position and heading by three beacons and a rotating laser", R"(
While the position is known, each reflection is assigned to the beacon that is expected in its
direction (within `gate`) and with its width (within `width-tolerance`); the bearing goes to a
Kalman filter (`ekf`), which fuses it with odometry. Other reflections are rejected: slip rings that
oxidise, and shiny things beside the field, produce them.

Without three accepted bearings within `timeout` the position is `lost`. Then three successive reflections are triangulated (V. Pierlot, M. Van
Droogenbroeck, IEEE Transactions on Robotics 30, 2014) in each assignment to the beacons; the bearings were taken from three places and are corrected
by odometry. If one assignment gives a place in the field that explains the widths clearly better than the others, `fix-new` is TRUE for one cycle: the
filter starts again from `fix-x`, `fix-y`, `fix-heading`. Near the circle through the three beacons no position exists (D = 0): `degenerate` counts.

The beacons have numbers 1 to 3 in the order in which a laser that turns to the left meets them from
inside of their triangle. `time` is the clock of the scanner; only its differences matter.

    loadrt beacon_position names=beacons
    addf beacons.update servo
    setp beacons.beacon-1-x 3.062
    setp beacons.beacon-1-y 1.05
    net seen-now   => beacons.new
    net seen-angle => beacons.angle
    net bearing1   <= beacons.bearing-1
)")
