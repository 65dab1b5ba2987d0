// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <numbers>

#include "hal/component.hpp"
#include "hal/limit.hpp"
#include "hal/retained.hpp"

namespace {

struct DiffDrive : hal::Component {
    using Component::Component;

    hal::In<double> linear{*this, "linear", "requested forward speed", {.unit = "m/s"}};
    hal::In<double> angular{
        *this, "angular", "requested turning speed, positive to the left", {.unit = "rad/s"}};
    hal::In<bool> enable{
        *this, "enable", "FALSE: both wheels are commanded to rest at once", {.initial = true}};
    hal::In<double> left_angle{*this,
                               "left-angle",
                               "measured angle of the left wheel, positive forwards",
                               {.unit = "rad"}};
    hal::In<double> right_angle{*this,
                                "right-angle",
                                "measured angle of the right wheel, positive forwards",
                                {.unit = "rad"}};
    hal::In<bool> load{*this, "load", "TRUE sets the pose to load-x, load-y, load-heading"};
    hal::In<double> load_x{*this, "load-x", "x of the robot to set", {.unit = "m"}};
    hal::In<double> load_y{*this, "load-y", "y of the robot to set", {.unit = "m"}};
    hal::In<double> load_heading{
        *this, "load-heading", "heading of the robot to set", {.unit = "rad"}};

    hal::Param<double> left_radius{
        *this, "left-radius", "radius of the left wheel", {.initial = 0.04, .unit = "m"}};
    hal::Param<double> right_radius{
        *this, "right-radius", "radius of the right wheel", {.initial = 0.04, .unit = "m"}};
    hal::Param<double> track{*this,
                             "track",
                             "distance between the wheels' contact points",
                             {.initial = 0.25, .unit = "m"}};
    hal::OptionalLimitParam max_rim{*this,
                                    "max-wheel-speed",
                                    "limit on the rim speed of each wheel; 0: no limit",
                                    {.unit = "m/s"}};
    hal::OptionalLimitParam max_linear{
        *this, "max-linear", "limit on the forward speed; 0: no limit", {.unit = "m/s"}};
    hal::OptionalLimitParam max_angular{
        *this, "max-angular", "limit on the turning speed; 0: no limit", {.unit = "rad/s"}};
    hal::OptionalLimitParam max_linear_acceleration{
        *this,
        "max-linear-acceleration",
        "limit on the forward acceleration; 0: no limit",
        {.unit = "m/s^2"}};
    hal::OptionalLimitParam max_angular_acceleration{
        *this,
        "max-angular-acceleration",
        "limit on the angular acceleration; 0: no limit",
        {.unit = "rad/s^2"}};

    hal::Out<double> left_speed{*this,
                                "left-speed",
                                "commanded speed of the left wheel",
                                {.unit = "rad/s", .safe = 0.0, .finite = true}};
    hal::Out<double> right_speed{*this,
                                 "right-speed",
                                 "commanded speed of the right wheel",
                                 {.unit = "rad/s", .safe = 0.0, .finite = true}};
    hal::Out<bool> limited{*this, "limited", "TRUE: a limit reduces the commanded speeds"};
    hal::Out<double> x{*this, "x", "x of the centre of the axle", {.unit = "m", .finite = true}};
    hal::Out<double> y{*this, "y", "y of the centre of the axle", {.unit = "m", .finite = true}};
    hal::Out<double> heading{*this,
                             "heading",
                             "heading: 0 along x, positive to the left, -pi..pi",
                             {.unit = "rad", .finite = true}};
    hal::Out<double> turned{
        *this, "turned", "heading including whole turns", {.unit = "rad", .finite = true}};
    hal::Out<double> distance{*this,
                              "distance",
                              "distance covered by the centre of the axle; negative backwards",
                              {.unit = "m", .finite = true}};
    hal::Out<double> actual_linear{
        *this, "actual-linear", "measured forward speed", {.unit = "m/s", .finite = true}};
    hal::Out<double> actual_angular{
        *this, "actual-angular", "measured turning speed", {.unit = "rad/s", .finite = true}};

    hal::Function measure{*this, "odometry", &DiffDrive::odometry,
                          "computes pose and speeds from the wheel angles"};
    hal::Function run{*this, "command", &DiffDrive::command,
                      "computes the wheel speeds from the requested motion"};

    /// Follows the pose by the angles of the wheels. An angle that is not finite does not move it,
    /// and a sum that has grown beyond all measure starts at 0 again.
    void odometry(hal::Cycle cycle) noexcept {
        const double left = left_angle;
        const double right = right_angle;
        const double base = width();
        // FALSE for NaN, too
        const bool good = std::fabs(left) <= max && std::fabs(right) <= max;
        double way = 0.0;
        double turn = 0.0;
        if (good && started_) {
            const double l = (left - last_left_) * radius(left_radius);

            const double r = (right - last_right_) * radius(right_radius);
            way = (l + r) / 2;
            turn = (r - l) / base;
        }
        if (good) {
            last_left_ = left;
            last_right_ = right;
            started_ = true;
        }
        if (load) {
            if (std::fabs(load_x) <= max) {
                x_ = load_x;
            }
            if (std::fabs(load_y) <= max) {
                y_ = load_y;
            }
            if (std::fabs(load_heading) <= max) {
                heading_ = load_heading;
            }
            distance_ = 0.0;
        } else {
            // The chord of the arc, in the direction at its midpoint: exact while the ratio of the
            // wheel speeds is constant.
            const double half = turn / 2;
            const double chord =
                std::fabs(half) < 1e-4 ? 1 - half * half / 6 : std::sin(half) / half;
            x_ += way * chord * std::cos(heading_ + half);
            y_ += way * chord * std::sin(heading_ + half);
            heading_ += turn;
            distance_ += way;
        }
        if (!(std::fabs(x_) + std::fabs(y_) + std::fabs(heading_) + std::fabs(distance_) <= 1e60)) {
            x_ = y_ = heading_ = distance_ = 0.0;
        }
        x = x_;
        y = y_;
        turned = heading_;
        distance = distance_;
        double within = std::remainder(heading_, 2 * std::numbers::pi);
        if (within <= -std::numbers::pi) {
            within += 2 * std::numbers::pi;
        }
        heading = within;
        actual_linear = way / cycle.seconds();
        actual_angular = turn / cycle.seconds();
    }

    void command(hal::Cycle cycle) noexcept {
        const double wanted_v = std::isfinite(linear) ? std::clamp(linear.get(), -max, max) : 0.0;
        const double wanted_w = std::isfinite(angular) ? std::clamp(angular.get(), -max, max) : 0.0;
        // All limits scale (v, w) as a vector, so that the robot stays on its curve.
        double share = 1.0;
        const auto within = [&](double value, double limit) {
            if (limit > 0.0 && std::fabs(value) * share > limit) {
                share = limit / std::fabs(value);
            }
        };
        within(wanted_v, max_linear);
        within(wanted_w, max_angular);
        within(std::fabs(wanted_v) + std::fabs(wanted_w) * width() / 2, max_rim);
        const double v = share * wanted_v;
        const double w = share * wanted_w;

        double step = 1.0;
        const auto slowly = [&](double change, double limit) {
            if (limit > 0.0 && std::fabs(change) * step > limit * cycle.seconds()) {
                step = limit * cycle.seconds() / std::fabs(change);
            }
        };
        slowly(v - v_, max_linear_acceleration);
        slowly(w - w_, max_angular_acceleration);
        v_ = step < 1.0 ? v_ + step * (v - v_) : v;
        w_ = step < 1.0 ? w_ + step * (w - w_) : w;
        if (!enable) {
            v_ = 0.0;
            w_ = 0.0;
        }
        if (!std::isfinite(v_ + w_)) {
            v_ = w_ = 0.0;
        }
        limited = enable && (v_ != wanted_v || w_ != wanted_w);
        left_speed = (v_ - w_ * width() / 2) / radius(left_radius);
        right_speed = (v_ + w_ * width() / 2) / radius(right_radius);
    }

private:
    static constexpr double max = 1e15;
    static double radius(double given) noexcept {
        return given > 1e-9 ? std::min(given, 1e9) : 1e-9;
    }
    double width() const noexcept { return radius(track); }

    double x_ = 0.0;
    double y_ = 0.0;
    double heading_ = 0.0;
    double distance_ = 0.0;
    double last_left_ = 0.0;
    double last_right_ = 0.0;
    double v_ = 0.0;
    double w_ = 0.0;
    bool started_ = false;
    hal::Retained retained_{*this,
                            {{"x", x_},
                             {"y", y_},
                             {"heading", heading_},
                             {"distance", distance_},
                             {"last-left", last_left_},
                             {"last-right", last_right_},
                             {"v", v_},
                             {"w", w_},
                             {"started", started_}}};
};

}  // namespace

HAL_COMPONENT(DiffDrive, "diff_drive", "Kinematics and odometry of a robot on two driven wheels",
              R"(
    left-speed  = (linear - angular track / 2) / left-radius
    right-speed = (linear + angular track / 2) / right-radius

    l, r    = distances of the wheels in a cycle,  way = (l + r) / 2,  turn = (r - l) / track
    x      += way * sin(turn/2) / (turn/2) * cos(heading + turn/2)
    y      += way * sin(turn/2) / (turn/2) * sin(heading + turn/2)
    heading += turn

(G. Dudek, M. Jenkin, *Computational Principles of Mobile Robotics*, chapter 3; the chord of the arc
as in J. Borenstein, H. Everett, L. Feng, *Where am I?*, 1996, 1.3.1, with the exact factor.) The
pose is exact if the ratio of the wheel speeds is constant within a cycle. Units are SI; heading 0
is along x, positive to the left. The radii are separate because they differ on a real robot
(calibrate them).

The speed limits scale `linear` and `angular` together, so the robot stays on its curve at a lower
speed; the acceleration limits scale their changes together. `enable` FALSE commands standstill
immediately. NaN wheel angles are ignored; the next valid angle includes the motion meanwhile. The
first cycle only stores the angles. A radius or track that is not positive counts as 1e-9.

    loadrt diff_drive names=base
    addf base.odometry servo
    addf base.command servo
    setp base.track 0.28
    setp base.max-wheel-speed 1
    setp base.max-linear-acceleration 5
    net left-wheel  => base.left-angle
    net right-wheel => base.right-angle
    net left-speed  <= base.left-speed
    net right-speed <= base.right-speed
)")
