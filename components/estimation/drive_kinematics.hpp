// SPDX-License-Identifier: MIT
#pragma once

#include "estimation/kinematics.hpp"
#include "hal/retained.hpp"

namespace hal::estimation {

/// v = (right + left) / 2, w = (right - left) / track. The path of a cycle is an arc; its chord is
/// added to the position.
class DriveKinematics : public Kinematics {
public:
    explicit DriveKinematics(const hal_host* host)
        : Kinematics(host, 2,
                     {"measured speed of wheel # (0: left, 1: right), m/s",
                      "target-0: forward speed (m/s); target-1: turning speed (rad/s); the others "
                      "have no effect",
                      "odometry: x y (m), heading (rad), forward speed (m/s), turning speed "
                      "(rad/s), distance driven (m)",
                      "speed of wheel # that reaches the target: m/s",
                      "while TRUE, the odometry is reset to 0", 0.0}) {}

    /// The wheels follow the target also when a measured speed is invalid, so that the robot can be
    /// stopped; an invalid target stops it.
    void update(Cycle cycle) noexcept {
        const bool has_track = is_valid(track);
        const bool is_measured = read_joints() && has_track;
        const bool is_commanded = is_valid(target[0]) && is_valid(target[1]) && has_track;
        const double width = track > 0.0 ? track.get() : 1.0;
        if (is_measured) {
            integrate(width, cycle.seconds());
        }
        const double turning = is_commanded ? 0.5 * width * target[1] : 0.0;
        const double forward = is_commanded ? target[0].get() : 0.0;
        command[0] = forward - turning;
        command[1] = forward + turning;
        if (!is_measured || !is_commanded) return reject_inputs();
        solved = track > 0.0;
    }

private:
    void integrate(double width, double dt) noexcept {
        const double v = 0.5 * (measured_(0) + measured_(1));
        const double w = (measured_(1) - measured_(0)) / width;
        if (follow) {
            x_ = y_ = heading_ = distance_ = 0.0;
        }
        const double turn = 0.5 * w * dt;
        const bool is_arc = std::fabs(turn) > 1e-6;
        const double chord = is_arc ? std::sin(turn) / turn : 1.0 - turn * turn / 6.0;
        x_ += v * dt * chord * std::cos(heading_ + turn);
        y_ += v * dt * chord * std::sin(heading_ + turn);
        heading_ = std::remainder(heading_ + w * dt, 2.0 * pi);
        distance_ += std::fabs(v) * dt;
        const double shown[] = {x_, y_, heading_, v, w, distance_};
        for (std::size_t i = 0; i < 6; ++i) {
            pose[i] = shown[i];
        }
    }

    double x_ = 0.0;
    double y_ = 0.0;
    double heading_ = 0.0;
    double distance_ = 0.0;
    Retained retained_{*this,
                       {{"x", x_}, {"y", y_}, {"heading", heading_}, {"distance", distance_}}};

public:
    Param<double> track{
        *this, "track", "distance between the wheels", {.initial = 0.3, .unit = "m"}};
    Function run{
        *this, "update", &DriveKinematics::update,
        "computes the odometry from the wheel speeds, and the wheel commands from the target"};
};

}  // namespace hal::estimation
