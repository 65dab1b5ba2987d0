// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "estimation/kinematics.hpp"
#include "hal/limit.hpp"
#include "hal/retained.hpp"

namespace hal::estimation {

/// The table rotates the workpiece by C about z, then by A about x; both axes meet in the pivot. X
/// Y Z move the tool.
class MillKinematics : public Kinematics {
public:
    explicit MillKinematics(const hal_host* host)
        : Kinematics(host, 5,
                     {"measured position of axis # of X Y Z (m), A C (rad)",
                      "target in the workpiece's frame: tip x y z (m), tool direction i j k",
                      "tool in the workpiece's frame: tip x y z (m), direction i j k",
                      "position of axis # of X Y Z A C that reaches the target: m, rad",
                      "without effect"}) {
        solved_ = measured_;
        Retained(*this, {{"solved", solved_}, {"has-run", has_run_}});
    }

    /// A and C move at most with max-speed; X Y Z keep the tip where it belongs meanwhile.
    void update(Cycle cycle) noexcept {
        if (!read_inputs({pivot_x, pivot_y, pivot_z, tool_length})) return;
        if (!has_run_) {
            solved_ = measured_;
            has_run_ = true;
        }
        const Eigen::Vector3d pivot(pivot_x, pivot_y, pivot_z);
        const Eigen::Matrix3d now = table(measured_(3), measured_(4));
        const Eigen::Vector3d tip(measured_(0) - pivot(0), measured_(1) - pivot(1),
                                  measured_(2) - tool_length - pivot(2));
        for (Eigen::Index i = 0; i < 3; ++i) {
            double at = pivot(i);
            for (Eigen::Index k = 0; k < 3; ++k) {
                at += now(k, i) * tip(k);
            }
            pose[static_cast<std::size_t>(i)] = at;
            // the tool is parallel to z of the machine
            pose[static_cast<std::size_t>(3 + i)] = now(2, i);
        }
        const double i = target[3];
        const double j = target[4];
        const double k = target[5];

        const double size = std::sqrt(i * i + j * j + k * k);
        const bool direction = size > 1e-9;
        // Rx(a) Rz(c) (i j k) = z: c turns the direction into the plane of y and z, a lifts it
        const double side = std::hypot(i, j);
        bool reached = true;
        if (direction && side > 1e-9 * size) {
            double c = std::atan2(i, j);
            double a = std::atan2(side, k);
            if (const double other = std::remainder(c + pi - solved_(4), 2.0 * pi);
                std::fabs(other) < std::fabs(std::remainder(c - solved_(4), 2.0 * pi))) {
                c += pi;
                a = -a;
            }
            const double shorter = std::remainder(c - solved_(4), 2.0 * pi);
            reached = turn(a - solved_(3), shorter, cycle.seconds());
        } else if (direction) {
            // upright: any C is a solution, so it does not move
            reached = turn((k > 0.0 ? 0.0 : pi) - solved_(3), 0.0, cycle.seconds());
        }
        const Eigen::Matrix3d wanted = table(solved_(3), solved_(4));
        for (Eigen::Index r = 0; r < 3; ++r) {
            double at = pivot(r) + (r == 2 ? tool_length.get() : 0.0);
            for (Eigen::Index c = 0; c < 3; ++c) {
                at += wanted(r, c) * (target[static_cast<std::size_t>(c)] - pivot(c));
            }
            solved_(r) = at;
        }
        manipulability = direction ? side / size : 0.0;
        solved = direction && reached;
        for (std::size_t n = 0; n < 5; ++n) {
            command[n] = solved_(static_cast<Eigen::Index>(n));
        }
    }

private:
    /// Turns A and C by these angles, both by the same share where max-speed is too low. Returns
    /// false then.
    bool turn(double a, double c, double dt) noexcept {
        const double allowed = std::fmax(max_speed * dt, 0.0);
        const double largest = std::fmax(std::fabs(a), std::fabs(c));
        const double share = largest > allowed ? allowed / largest : 1.0;
        solved_(3) += share * a;
        solved_(4) += share * c;
        return share == 1.0;
    }

    /// Returns the rotation from the workpiece to the machine: Rx(a) Rz(c).
    static Eigen::Matrix3d table(double a, double c) noexcept {
        Eigen::Matrix3d r;
        r << std::cos(c), -std::sin(c), 0.0, std::cos(a) * std::sin(c), std::cos(a) * std::cos(c),
            -std::sin(a), std::sin(a) * std::sin(c), std::sin(a) * std::cos(c), std::cos(a);
        return r;
    }

    Vector solved_;
    bool has_run_ = false;

public:
    Param<double> pivot_x{*this, "pivot-x", "x of the intersection of A and C", {.unit = "m"}};
    Param<double> pivot_y{*this, "pivot-y", "y of the intersection of A and C", {.unit = "m"}};
    Param<double> pivot_z{*this, "pivot-z", "z of the intersection of A and C", {.unit = "m"}};
    Param<double> tool_length{
        *this, "tool-length", "distance from the spindle nose to the tool tip", {.unit = "m"}};
    LimitParam max_speed{
        *this, "max-speed", "highest speed of A and C", {.initial = 10.0, .unit = "rad/s"}};
    Out<double> manipulability{
        *this, "manipulability",
        "sine of the target's tilt: 0 at the singularity, where the tool is upright"};
    Function run{*this, "update", &MillKinematics::update,
                 "computes pose from the axes, and the axis commands from the target"};
};

}  // namespace hal::estimation
