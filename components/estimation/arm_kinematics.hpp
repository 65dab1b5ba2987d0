// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <string>
#include <vector>

#include "estimation/kinematics.hpp"
#include "estimation/matrices.hpp"
#include "hal/limit.hpp"
#include "hal/retained.hpp"

namespace hal::estimation {

using Transform = Eigen::Matrix4d;

/// One joint in Denavit-Hartenberg convention: rotate by theta about z, move by d along z and by a
/// along x, rotate by alpha about x.
struct ArmLink {
    double a, alpha, d, theta;
    bool prismatic;
};

/// A serial arm, in fixed memory. [realtime]
struct Arm {
    std::vector<ArmLink> links;

    Transform joint(std::size_t i, double q) const noexcept {
        const ArmLink& l = links[i];
        const double theta = l.theta + (l.prismatic ? 0.0 : q);
        const double d = l.d + (l.prismatic ? q : 0.0);
        const double ct = std::cos(theta);
        const double st = std::sin(theta);
        const double ca = std::cos(l.alpha);

        const double sa = std::sin(l.alpha);
        Transform t;
        t << ct, -st * ca, st * sa, l.a * ct, st, ct * ca, -ct * sa, l.a * st, 0.0, sa, ca, d, 0.0,
            0.0, 0.0, 1.0;
        return t;
    }
    /// Returns the pose of the end effector and sets its Jacobian (six rows, a column per joint).
    Transform forward(const Vector& q, Matrix& jacobian) const noexcept {
        Transform t = Transform::Identity();
        Eigen::Vector3d axes[max], origins[max];
        for (std::size_t i = 0; i < links.size(); ++i) {
            axes[i] = t.block<3, 1>(0, 2);
            origins[i] = t.block<3, 1>(0, 3);
            t = (t.lazyProduct(joint(i, q(static_cast<Eigen::Index>(i))))).eval();
        }
        const Eigen::Vector3d tip = t.block<3, 1>(0, 3);
        jacobian.setZero(6, static_cast<Eigen::Index>(links.size()));
        for (std::size_t i = 0; i < links.size(); ++i) {
            const auto column = static_cast<Eigen::Index>(i);
            if (links[i].prismatic) {
                jacobian.block<3, 1>(0, column) = axes[i];
                continue;
            }
            jacobian.block<3, 1>(0, column) = axes[i].cross(tip - origins[i]);
            jacobian.block<3, 1>(3, column) = axes[i];
        }
        return t;
    }
};

/// Returns the rotation by roll, pitch and yaw: about the fixed axes x, then y, then z.
inline Eigen::Matrix3d rotation(double roll, double pitch, double yaw) noexcept {
    const double cr = std::cos(roll);
    const double sr = std::sin(roll);
    const double cp = std::cos(pitch);

    const double sp = std::sin(pitch);
    const double cy = std::cos(yaw);
    const double sy = std::sin(yaw);
    Eigen::Matrix3d r;
    r << cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr, sy * cp, sy * sp * sr + cy * cr,
        sy * sp * cr - cy * sr, -sp, cp * sr, cp * cr;
    return r;
}

class ArmKinematics : public Kinematics {
public:
    explicit ArmKinematics(const hal_host* host) : ArmKinematics(host, read_table(host)) {}

    /// Damped least squares (Y. Nakamura, H. Hanafusa, *Inverse Kinematic Solutions with
    /// Singularity Robustness*, 1986):
    ///     step = J' (J J' + damping² I)^-1 residual
    /// a fixed number of steps a cycle, from where the last cycle ended. No joint moves faster than
    /// max-speed: all of them cover the same share of their way.
    void update(Cycle cycle) noexcept {
        if (!read_inputs()) return;
        Matrix j;
        show(arm_.forward(measured_, j));
        if (follow) {
            solved_ = measured_;
        }
        if (!has_run_) {
            given_ = solved_;
            has_run_ = true;
        }
        const double weight = position_only ? 0.0 : 1.0;
        const double damp = std::fmax(std::fabs(damping), 1e-6);
        Vector residual;
        for (std::uint32_t i = 0; i < std::min<std::uint32_t>(iterations, 50); ++i) {
            compare(arm_.forward(solved_, j), weight, residual);
            if (weight == 0.0) {
                j.bottomRows(3).setZero();
            }
            step(j, residual, damp);
        }
        if (!finite(solved_)) {
            solved_ = given_;
        }
        limit_step(cycle.seconds());
        compare(arm_.forward(solved_, j), weight, residual);
        double size = 0.0;
        for (Eigen::Index i = 0; i < 6; ++i) {
            size = std::fmax(size, std::fabs(residual(i)));
        }
        manipulability = measure(j, weight);
        error = size;
        solved = size <= tolerance;
        given_ = solved_;
        for (std::size_t i = 0; i < command.size(); ++i) {
            command[i] = solved_(static_cast<Eigen::Index>(i));
        }
    }

private:
    ArmKinematics(const hal_host* host, Arm arm)
        : Kinematics(
              host, static_cast<std::int64_t>(arm.links.size()),
              {"measured position of joint #: rad, or m for a prismatic joint",
               "target pose: x y z (m), roll pitch yaw (rad)",
               "pose of the end effector at the measured joints: x y z (m), roll pitch yaw (rad)",
               "position of joint # that reaches the target: rad or m",
               "while TRUE, each solution starts at the measured joints"}),
          arm_(std::move(arm)) {
        solved_ = measured_;
        given_ = measured_;
        Retained(*this, {{"solved", solved_}, {"given", given_}, {"has-run", has_run_}});
    }

    /// Shortens the step of all joints alike so that none exceeds max-speed.
    void limit_step(double dt) noexcept {
        const double allowed = max_speed * dt;
        double largest = 0.0;
        for (Eigen::Index i = 0; i < solved_.size(); ++i) {
            largest = std::fmax(largest, std::fabs(solved_(i) - given_(i)));
        }
        if (!(largest > allowed)) return;
        const double share = std::fmax(allowed, 0.0) / largest;
        for (Eigen::Index i = 0; i < solved_.size(); ++i) {
            solved_(i) = given_(i) + share * (solved_(i) - given_(i));
        }
    }

    /// Reads the argument `dh`. [setup]
    static Arm read_table(const hal_host* host) {
        Component asking(host);
        const Matrices given(asking, {{"DH", "0.3,0,0,0;0.2,0,0,0",
                                       "Denavit-Hartenberg table, a row per joint: a, alpha, d, "
                                       "theta (m, rad); a fifth column is 1 for a "
                                       "prismatic joint"}});
        const Eigen::MatrixXd& table = given.at("DH").value;
        if (table.cols() != 4 && table.cols() != 5) {
            given.refuse("DH",
                         "DH has " + std::to_string(table.cols()) + " columns, expected 4 or 5",
                         "write a row per joint: a, alpha, d, theta and, for a prismatic joint, 1");
        }
        if (table.rows() > 8) {
            given.refuse("DH", "DH has " + std::to_string(table.rows()) + " rows",
                         "an arm has at most 8 joints");
        }
        Arm arm;
        for (Eigen::Index i = 0; i < table.rows(); ++i) {
            arm.links.push_back({table(i, 0), table(i, 1), table(i, 2), table(i, 3),
                                 table.cols() == 5 && table(i, 4) != 0.0});
        }
        return arm;
    }

    void show(const Transform& t) noexcept {
        for (std::size_t i = 0; i < 3; ++i) {
            pose[i] = t(static_cast<Eigen::Index>(i), 3);
        }
        pose[3] = std::atan2(t(2, 1), t(2, 2));
        pose[4] = std::atan2(-t(2, 0), std::hypot(t(0, 0), t(1, 0)));
        pose[5] = std::atan2(t(1, 0), t(0, 0));
    }
    /// Sets `residual` to the difference from `t` to the target: three lengths and a rotation
    /// vector.
    void compare(const Transform& t, double weight, Vector& residual) const noexcept {
        residual.setZero(6);
        for (Eigen::Index i = 0; i < 3; ++i) {
            residual(i) = target[static_cast<std::size_t>(i)] - t(i, 3);
        }
        if (weight == 0.0) return;
        const Eigen::Matrix3d wanted = rotation(target[3], target[4], target[5]);

        const Eigen::Matrix3d turn = wanted.lazyProduct(t.block<3, 3>(0, 0).transpose());
        const Eigen::Vector3d axis(turn(2, 1) - turn(1, 2), turn(0, 2) - turn(2, 0),
                                   turn(1, 0) - turn(0, 1));
        const double sine = 0.5 * axis.norm();
        const double cosine = 0.5 * (turn.trace() - 1.0);

        const double angle = std::atan2(sine, cosine);
        if (sine > 1e-12) {
            for (Eigen::Index i = 0; i < 3; ++i) {
                residual(3 + i) = weight * 0.5 * axis(i) / sine * angle;
            }
        } else if (cosine < 0.0) {
            // half a turn is 2 a a' - 1; each column that is not 0 is along the axis a after
            // adding 1
            Eigen::Index k = 0;
            for (Eigen::Index i = 1; i < 3; ++i) {
                if (turn(i, i) > turn(k, k)) {
                    k = i;
                }
            }
            Eigen::Vector3d column = turn.col(k);
            column(k) += 1.0;
            for (Eigen::Index i = 0; i < 3; ++i) {
                residual(3 + i) = weight * pi * column(i) / column.norm();
            }
        }
    }
    void step(const Matrix& j, const Vector& residual, double damp) noexcept {
        Matrix square(6, 6);
        for (Eigen::Index r = 0; r < 6; ++r) {
            for (Eigen::Index c = 0; c < 6; ++c) {
                double sum = r == c ? damp * damp : 0.0;
                for (Eigen::Index k = 0; k < j.cols(); ++k) {
                    sum += j(r, k) * j(c, k);
                }
                square(r, c) = sum;
            }
        }
        Vector y = residual;
        if (!cholesky(square, y)) return;
        for (Eigen::Index k = 0; k < j.cols(); ++k) {
            double sum = 0.0;
            for (Eigen::Index r = 0; r < 6; ++r) {
                sum += j(r, k) * y(r);
            }
            solved_(k) += std::clamp(sum, -0.5, 0.5);
        }
    }
    /// Solves s x = y in place for a positive definite s, whose lower half becomes its factor.
    /// False when s is not positive definite.
    static bool cholesky(Matrix& s, Vector& y) noexcept {
        const Eigen::Index n = s.rows();
        for (Eigen::Index i = 0; i < n; ++i) {
            for (Eigen::Index j = 0; j <= i; ++j) {
                double sum = s(i, j);
                for (Eigen::Index k = 0; k < j; ++k) {
                    sum -= s(i, k) * s(j, k);
                }
                if (i == j) {
                    if (!(sum > 0.0)) return false;
                    s(i, i) = std::sqrt(sum);
                } else {
                    s(i, j) = sum / s(j, j);
                }
            }
        }
        for (Eigen::Index i = 0; i < n; ++i) {
            for (Eigen::Index k = 0; k < i; ++k) {
                y(i) -= s(i, k) * y(k);
            }
            y(i) /= s(i, i);
        }
        for (Eigen::Index i = n - 1; i >= 0; --i) {
            for (Eigen::Index k = i + 1; k < n; ++k) {
                y(i) -= s(k, i) * y(k);
            }
            y(i) /= s(i, i);
        }
        return true;
    }
    /// Returns the square root of det(J'J) or det(JJ'), whichever is smaller: 0 at a singularity
    /// (T. Yoshikawa, 1985).
    static double measure(const Matrix& j, double weight) noexcept {
        const Eigen::Index rows = weight == 0.0 ? 3 : 6;
        const Eigen::Index n = std::min(rows, j.cols());
        Matrix square(n, n);
        for (Eigen::Index r = 0; r < n; ++r) {
            for (Eigen::Index c = 0; c < n; ++c) {
                double sum = 0.0;
                if (j.cols() < rows) {
                    for (Eigen::Index k = 0; k < rows; ++k) {
                        sum += j(k, r) * j(k, c);
                    }
                } else {
                    for (Eigen::Index k = 0; k < j.cols(); ++k) {
                        sum += j(r, k) * j(c, k);
                    }
                }
                square(r, c) = sum;
            }
        }
        Vector unused = Vector::Zero(n);
        if (!cholesky(square, unused)) return 0.0;
        double product = 1.0;
        for (Eigen::Index i = 0; i < n; ++i) {
            product *= square(i, i);
        }
        return product;
    }

    Arm arm_;
    Vector solved_;
    Vector given_;  // the last commands
    bool has_run_ = false;

public:
    In<bool> position_only{
        *this, "position-only",
        "TRUE ignores the target's orientation; for arms with fewer than 6 joints"};
    Param<std::uint32_t> iterations{
        *this, "iterations", "solver steps per cycle, 0..50", {.initial = 4}};
    Param<double> damping{
        *this,
        "damping",
        "solver damping; a larger value is smoother near singularities but converges more slowly",
        {.initial = 0.01}};
    LimitParam max_speed{*this, "max-speed",
                         "highest speed of a command: rad/s, or m/s for a prismatic joint",
                         {.initial = 10.0}};
    Param<double> tolerance{
        *this, "tolerance", "largest error (m, rad) at which solved is TRUE", {.initial = 1e-6}};
    Out<double> error{*this, "error", "largest component of the remaining error (m, rad)"};
    Out<double> manipulability{
        *this, "manipulability",
        "distance from a singularity (Yoshikawa's measure): 0 when the arm is fully stretched"};
    Function run{*this, "update", &ArmKinematics::update,
                 "computes pose from the joints, and the joint commands from the target"};
};

}  // namespace hal::estimation
