// SPDX-License-Identifier: MIT
#include <cmath>
#include <numbers>

#include "floor_argument.hpp"
#include "hal/component.hpp"
#include "hal/retained.hpp"

namespace {

struct SimDiffBase : hal::Component {
    using Component::Component;

    hal::TextArgument floor_file{
        *this, "floor", "",
        "file beside the netlist with walls and obstacles; default: an empty floor"};
    hal::RealArgument start_x{*this, "x", 0.0, "x at the start, m"};
    hal::RealArgument start_y{*this, "y", 0.0, "y at the start, m"};
    hal::RealArgument start_heading{*this, "heading", 0.0, "heading at the start, rad"};

    hal::In<double> left_angle{
        *this, "left-angle", "angle of the left wheel, positive forwards", {.unit = "rad"}};
    hal::In<double> right_angle{
        *this, "right-angle", "angle of the right wheel, positive forwards", {.unit = "rad"}};
    hal::In<bool> lift{
        *this, "lift",
        "TRUE: the robot is carried to place-x, place-y, place-heading; its wheels do not notice"};
    hal::In<double> place_x{*this, "place-x", "x to which it is carried", {.unit = "m"}};
    hal::In<double> place_y{*this, "place-y", "y to which it is carried", {.unit = "m"}};
    hal::In<double> place_heading{
        *this, "place-heading", "heading to which it is carried", {.unit = "rad"}};
    hal::Param<double> left_radius{
        *this, "left-radius", "radius of the left wheel", {.initial = 0.04, .unit = "m"}};
    hal::Param<double> right_radius{
        *this, "right-radius", "radius of the right wheel", {.initial = 0.04, .unit = "m"}};
    hal::Param<double> track{*this,
                             "track",
                             "distance between the wheels' contact points",
                             {.initial = 0.25, .unit = "m"}};
    hal::Param<double> body{
        *this, "body-radius", "radius of the body", {.initial = 0.15, .unit = "m"}};

    hal::Out<double> x{
        *this, "x", "true x of the centre of the axle", {.unit = "m", .finite = true}};
    hal::Out<double> y{
        *this, "y", "true y of the centre of the axle", {.unit = "m", .finite = true}};
    hal::Out<double> heading{
        *this, "heading", "true heading, -pi..pi", {.unit = "rad", .finite = true}};
    hal::Out<double> clearance{
        *this,
        "clearance",
        "distance between the body and the nearest wall or obstacle; 1000: none",
        {.unit = "m", .finite = true}};
    hal::Out<bool> contact{*this, "contact",
                           "TRUE: an obstacle holds the robot, and its wheels slip"};
    hal::Out<std::uint32_t> contacts{*this, "contacts", "times that it met an obstacle"};

    hal::Function run{*this, "update", &SimDiffBase::update,
                      "moves the body as far as its wheels turned"};

    hal::mobile::FloorPlan floor = hal::mobile::floor_from(*this, floor_file.get());

    void update(hal::Cycle) noexcept {
        const double left = left_angle;
        const double right = right_angle;
        if (!begun_) {
            x_ = start_x;
            y_ = start_y;
            heading_ = start_heading;
        }
        if (lift && std::fabs(place_x) < 1e6 && std::fabs(place_y) < 1e6 &&
            std::fabs(place_heading) < 1e6) {
            x_ = place_x;
            y_ = place_y;
            heading_ = place_heading;
        }
        bool held = false;
        const double l = (left - last_left_) * left_radius;

        const double r = (right - last_right_) * right_radius;
        if (begun_ && std::fabs(l) < 1.0 && std::fabs(r) < 1.0 && track > 1e-3) {
            held = move((l + r) / 2, (r - l) / track);
        }
        if (std::isfinite(left) && std::isfinite(right)) {
            last_left_ = left;
            last_right_ = right;
            begun_ = true;
        }
        if (held && !contact) {
            contacts = contacts + 1;
        }
        contact = held;
        x = x_;
        y = y_;
        heading = std::remainder(heading_, 2 * std::numbers::pi);
        const double free = floor.clearance(x_, y_) - body;
        clearance = std::isfinite(free) ? free : 1000.0;
    }

private:
    /// The arc as its chord in the direction at its middle; a step that would reach into something
    /// only turns the robot.
    bool move(double way, double turn) noexcept {
        const double half = turn / 2;
        const double chord = std::fabs(half) < 1e-6 ? 1.0 : std::sin(half) / half;
        const double to_x = x_ + way * chord * std::cos(heading_ + half);

        const double to_y = y_ + way * chord * std::sin(heading_ + half);
        heading_ += turn;
        const double before = floor.clearance(x_, y_);
        const double after = floor.clearance(to_x, to_y);
        if (after < body && after < before) return true;
        x_ = to_x;
        y_ = to_y;
        return false;
    }

    double x_ = 0.0;
    double y_ = 0.0;
    double heading_ = 0.0;
    double last_left_ = 0.0;
    double last_right_ = 0.0;
    bool begun_ = false;
    hal::Retained retained_{*this,
                            {{"x", x_},
                             {"y", y_},
                             {"heading", heading_},
                             {"last-left", last_left_},
                             {"last-right", last_right_},
                             {"begun", begun_}}};
};

}  // namespace

HAL_COMPONENT(SimDiffBase, "sim_diff_base",
              "The body of a robot on two driven wheels, on a floor with obstacles", R"(
    way = (l + r) / 2,  turn = (r - l) / track,  l and r: distances that the rims cover
    the centre of the axle moves along the chord of its arc

Where the body, a circle, would come closer to an obstacle that it touches, it stays and its wheels
slip: `contact` is TRUE and odometry goes wrong, as it does on the real floor. The radii and the
track are those of the machine, not those that its odometry assumes. `lift` carries the robot
elsewhere.

The floor plan has lines `wall X1 Y1 X2 Y2`, `box X1 Y1 X2 Y2`, `circle X Y RADIUS` and
`beacon X Y RADIUS`, in metres, at most 256 shapes. The arguments `x`, `y` and `heading` are the
place at the start.

    loadrt sim_diff_base names=body x=0.5 y=0.5
    addf body.update servo
    net left-wheel  => body.left-angle
    net right-wheel => body.right-angle
)")
