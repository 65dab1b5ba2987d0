// SPDX-License-Identifier: MIT
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "estimation/matrices.hpp"
#include "hal/component.hpp"

namespace {

using namespace hal::estimation;
using Transform = Eigen::Matrix4d;

constexpr double pi = std::numbers::pi;

enum class Machine { arm, mill, drive };

/// One joint after Denavit and Hartenberg: turn by theta about z, move by d along z, by a along x, turn by alpha about x.
struct Link {
    double a, alpha, d, theta;
    bool   slides;
};

/// A serial arm, in fixed memory. [realtime]
struct Arm {
    std::vector<Link> links;

    Transform joint(std::size_t i, double q) const noexcept {
        const Link&  l = links[i];
        const double theta = l.theta + (l.slides ? 0.0 : q), d = l.d + (l.slides ? q : 0.0);
        const double ct = std::cos(theta), st = std::sin(theta), ca = std::cos(l.alpha), sa = std::sin(l.alpha);
        Transform    t;
        t << ct, -st * ca, st * sa, l.a * ct, st, ct * ca, -ct * sa, l.a * st, 0.0, sa, ca, d, 0.0, 0.0, 0.0, 1.0;
        return t;
    }
    /// Where the hand is, and (six rows, a column per joint) how the joints move it.
    Transform forward(const Vector& q, Matrix& jacobian) const noexcept {
        Transform       t = Transform::Identity();
        Eigen::Vector3d axes[most], places[most];
        for (std::size_t i = 0; i < links.size(); ++i) {
            axes[i] = t.block<3, 1>(0, 2);
            places[i] = t.block<3, 1>(0, 3);
            t = (t.lazyProduct(joint(i, q(static_cast<Eigen::Index>(i))))).eval();
        }
        const Eigen::Vector3d hand = t.block<3, 1>(0, 3);
        jacobian.setZero(6, static_cast<Eigen::Index>(links.size()));
        for (std::size_t i = 0; i < links.size(); ++i) {
            const auto column = static_cast<Eigen::Index>(i);
            if (links[i].slides) {
                jacobian.block<3, 1>(0, column) = axes[i];
                continue;
            }
            jacobian.block<3, 1>(0, column) = axes[i].cross(hand - places[i]);
            jacobian.block<3, 1>(3, column) = axes[i];
        }
        return t;
    }
};

/// Roll, pitch, yaw: turns about the fixed x, then y, then z.
Eigen::Matrix3d rotation(double roll, double pitch, double yaw) noexcept {
    const double cr = std::cos(roll), sr = std::sin(roll), cp = std::cos(pitch), sp = std::sin(pitch), cy = std::cos(yaw),
                 sy = std::sin(yaw);
    Eigen::Matrix3d r;
    r << cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr, sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr, -sp, cp * sr,
        cp * cr;
    return r;
}

class Kinematics : public hal::Component {
public:
    explicit Kinematics(const hal_host* host)
        : Component(host),
          machine_(*this, "machine", "arm",
                   "arm: a serial arm by its table; mill: five axes, the table turns by A and C; drive: two driven wheels"),
          arm_(read()),
          q(*this, "joint-#", joints(),
            "measured joint #: rad or m; of the mill X Y Z A C, of the drive the speeds of left and right wheel in m/s"),
          target(*this, "target-#", 6,
                 "wanted: x y z roll pitch yaw; of the mill the tip x y z and the tool's direction i j k; of the drive forward and turning "
                 "speed"),
          place(*this, "pose-#", 6,
                "where it is: x y z roll pitch yaw; of the mill x y z i j k; of the drive x y heading, forward, turning speed, way",
                {.finite = true}),
          command(*this, "command-#", joints(), "joint # that brings it to the target", {.finite = true}) {
        const Eigen::Index n = joints();
        measured_ = solved_ = Vector::Zero(n);
    }

    void update(hal::Cycle cycle) noexcept {
        bool numbers = true;
        for (std::size_t i = 0; i < q.size(); ++i) numbers = numbers && std::isfinite(q[i]) && std::fabs(q[i]) < 1e9;
        for (std::size_t i = 0; i < 6; ++i) numbers = numbers && std::isfinite(target[i]) && std::fabs(target[i]) < 1e9;
        if (!numbers) {
            bad_inputs = bad_inputs + 1;
            solved = false;
            return;
        }
        for (std::size_t i = 0; i < q.size(); ++i) measured_(static_cast<Eigen::Index>(i)) = q[i];
        if (kind_ == Machine::arm) move_arm();
        else if (kind_ == Machine::mill) move_mill();
        else move_drive(cycle.seconds());
    }

private:
    Eigen::Index joints() const noexcept {
        return kind_ == Machine::arm ? static_cast<Eigen::Index>(arm_.links.size()) : kind_ == Machine::mill ? 5 : 2;
    }

    Arm read() {
        if (machine_.get() == "mill") kind_ = Machine::mill;
        else if (machine_.get() == "drive") kind_ = Machine::drive;
        else if (machine_.get() != "arm") throw hal::ArgumentError("machine", "machine=" + machine_.get() + " is none of arm mill drive");
        const Matrices given(*this, {{"DH", "0.3,0,0,0;0.2,0,0,0",
                                      "a row per joint: a, alpha, d, theta and, for a joint that slides, a 1 behind; m and rad"}});
        Arm            arm;
        if (kind_ != Machine::arm) return arm;
        const Eigen::MatrixXd& table = given.at("DH").value;
        if (table.cols() != 4 && table.cols() != 5)
            given.refuse("DH", "DH has " + std::to_string(table.cols()) + " columns, not 4 or 5",
                         "a row per joint: a, alpha, d, theta and perhaps 1 for a joint that slides");
        if (table.rows() > 8) given.refuse("DH", "DH has " + std::to_string(table.rows()) + " rows", "an arm has at most 8 joints here");
        for (Eigen::Index i = 0; i < table.rows(); ++i)
            arm.links.push_back({table(i, 0), table(i, 1), table(i, 2), table(i, 3), table.cols() == 5 && table(i, 4) != 0.0});
        return arm;
    }

    void show(const Transform& t) noexcept {
        for (std::size_t i = 0; i < 3; ++i) place[i] = t(static_cast<Eigen::Index>(i), 3);
        place[3] = std::atan2(t(2, 1), t(2, 2));
        place[4] = std::atan2(-t(2, 0), std::hypot(t(0, 0), t(1, 0)));
        place[5] = std::atan2(t(1, 0), t(0, 0));
    }
    /// What is missing to the target: three lengths and a turn about an axis.
    void missing(const Transform& t, double weight, Vector& off) const noexcept {
        off.setZero(6);
        for (Eigen::Index i = 0; i < 3; ++i) off(i) = target[static_cast<std::size_t>(i)] - t(i, 3);
        if (weight == 0.0) return;
        const Eigen::Matrix3d wanted = rotation(target[3], target[4], target[5]),
                              turn = wanted.lazyProduct(t.block<3, 3>(0, 0).transpose());
        const Eigen::Vector3d axis(turn(2, 1) - turn(1, 2), turn(0, 2) - turn(2, 0), turn(1, 0) - turn(0, 1));
        const double          sine = 0.5 * axis.norm(), cosine = 0.5 * (turn.trace() - 1.0), angle = std::atan2(sine, cosine);
        if (sine > 1e-12) {
            for (Eigen::Index i = 0; i < 3; ++i) off(3 + i) = weight * 0.5 * axis(i) / sine * angle;
        } else if (cosine < 0.0) {  // half a turn: 2 a a' - 1, of which each column that is not 0 has the axis a
            Eigen::Index k = 0;
            for (Eigen::Index i = 1; i < 3; ++i)
                if (turn(i, i) > turn(k, k)) k = i;
            Eigen::Vector3d column = turn.col(k);
            column(k) += 1.0;
            for (Eigen::Index i = 0; i < 3; ++i) off(3 + i) = weight * pi * column(i) / column.norm();
        }
    }
    /// Damped least squares (Y. Nakamura, H. Hanafusa, *Inverse Kinematic Solutions with Singularity Robustness*, 1986):
    ///     step = J' (J J' + damping² I)^-1 off
    /// a fixed number of them a cycle, from where the last cycle ended.
    void move_arm() noexcept {
        Matrix j;
        show(arm_.forward(measured_, j));
        if (follow) solved_ = measured_;
        const double weight = position_only ? 0.0 : 1.0, damp = std::fmax(std::fabs(damping), 1e-6);
        Vector       off;
        for (std::uint32_t i = 0; i < std::min<std::uint32_t>(iterations, 50); ++i) {
            missing(arm_.forward(solved_, j), weight, off);
            if (weight == 0.0) j.bottomRows(3).setZero();
            step(j, off, damp);
        }
        missing(arm_.forward(solved_, j), weight, off);
        double size = 0.0, determinant = 1.0;
        for (Eigen::Index i = 0; i < 6; ++i) size = std::fmax(size, std::fabs(off(i)));
        determinant = reach(j, weight);
        manipulability = determinant;
        error = size;
        solved = size <= tolerance;
        if (!finite(solved_)) solved_ = measured_;
        for (std::size_t i = 0; i < command.size(); ++i) command[i] = solved_(static_cast<Eigen::Index>(i));
    }
    void step(const Matrix& j, const Vector& off, double damp) noexcept {
        Matrix square(6, 6);
        for (Eigen::Index r = 0; r < 6; ++r)
            for (Eigen::Index c = 0; c < 6; ++c) {
                double sum = r == c ? damp * damp : 0.0;
                for (Eigen::Index k = 0; k < j.cols(); ++k) sum += j(r, k) * j(c, k);
                square(r, c) = sum;
            }
        Vector y = off;
        if (!cholesky(square, y)) return;
        for (Eigen::Index k = 0; k < j.cols(); ++k) {
            double sum = 0.0;
            for (Eigen::Index r = 0; r < 6; ++r) sum += j(r, k) * y(r);
            solved_(k) += std::clamp(sum, -0.5, 0.5);
        }
    }
    /// Solves s y = y for a positive s, whose lower half becomes its factor; false: it is not positive.
    static bool cholesky(Matrix& s, Vector& y) noexcept {
        const Eigen::Index n = s.rows();
        for (Eigen::Index i = 0; i < n; ++i) {
            for (Eigen::Index j = 0; j <= i; ++j) {
                double sum = s(i, j);
                for (Eigen::Index k = 0; k < j; ++k) sum -= s(i, k) * s(j, k);
                if (i == j) {
                    if (!(sum > 0.0)) return false;
                    s(i, i) = std::sqrt(sum);
                } else s(i, j) = sum / s(j, j);
            }
        }
        for (Eigen::Index i = 0; i < n; ++i) {
            for (Eigen::Index k = 0; k < i; ++k) y(i) -= s(i, k) * y(k);
            y(i) /= s(i, i);
        }
        for (Eigen::Index i = n - 1; i >= 0; --i) {
            for (Eigen::Index k = i + 1; k < n; ++k) y(i) -= s(k, i) * y(k);
            y(i) /= s(i, i);
        }
        return true;
    }
    /// The root of det(J'J) or det(JJ'), whichever is smaller: 0 where the arm is stretched or folded (T. Yoshikawa, 1985).
    static double reach(const Matrix& j, double weight) noexcept {
        const Eigen::Index rows = weight == 0.0 ? 3 : 6, n = std::min(rows, j.cols());
        Matrix             square(n, n);
        for (Eigen::Index r = 0; r < n; ++r)
            for (Eigen::Index c = 0; c < n; ++c) {
                double sum = 0.0;
                if (j.cols() < rows)
                    for (Eigen::Index k = 0; k < rows; ++k) sum += j(k, r) * j(k, c);
                else
                    for (Eigen::Index k = 0; k < j.cols(); ++k) sum += j(r, k) * j(c, k);
                square(r, c) = sum;
            }
        Vector unused = Vector::Zero(n);
        if (!cholesky(square, unused)) return 0.0;
        double product = 1.0;
        for (Eigen::Index i = 0; i < n; ++i) product *= square(i, i);
        return product;
    }

    /// The table turns the workpiece by C about z, then by A about x; both axes meet in `pivot-x y z`. X Y Z move the tool.
    void move_mill() noexcept {
        const Eigen::Vector3d pivot(pivot_x, pivot_y, pivot_z);
        const auto            turned = [](double a, double c) {
            Eigen::Matrix3d r;  // from workpiece to machine: Rx(a) Rz(c)
            r << std::cos(c), -std::sin(c), 0.0, std::cos(a) * std::sin(c), std::cos(a) * std::cos(c), -std::sin(a),
                std::sin(a) * std::sin(c), std::sin(a) * std::cos(c), std::cos(a);
            return r;
        };
        const Eigen::Matrix3d now = turned(measured_(3), measured_(4));
        const Eigen::Vector3d tip(measured_(0) - pivot(0), measured_(1) - pivot(1), measured_(2) - tool_length - pivot(2));
        for (Eigen::Index i = 0; i < 3; ++i) {
            double at = pivot(i);
            for (Eigen::Index k = 0; k < 3; ++k) at += now(k, i) * tip(k);
            place[static_cast<std::size_t>(i)] = at;
            place[static_cast<std::size_t>(3 + i)] = now(2, i);  // the tool stands along z of the machine
        }
        const double i = target[3], j = target[4], k = target[5], size = std::sqrt(i * i + j * j + k * k);
        const bool   direction = size > 1e-9;
        // Rx(a) Rz(c) (i j k) = z: c brings the direction into the plane of y and z, a lifts it
        const double side = std::hypot(i, j);
        if (direction && side > 1e-9 * size) {
            double c = std::atan2(i, j), a = std::atan2(side, k);
            if (const double other = std::remainder(c + pi - solved_(4), 2.0 * pi);
                std::fabs(other) < std::fabs(std::remainder(c - solved_(4), 2.0 * pi)))
                c += pi, a = -a;
            solved_(4) += std::remainder(c - solved_(4), 2.0 * pi);  // the shorter way round
            solved_(3) = a;
        } else if (direction) solved_(3) = k > 0.0 ? 0.0 : pi;  // upright: any C will do, so it stays
        const Eigen::Matrix3d wanted = turned(solved_(3), solved_(4));
        for (Eigen::Index r = 0; r < 3; ++r) {
            double at = pivot(r) + (r == 2 ? tool_length.get() : 0.0);
            for (Eigen::Index c = 0; c < 3; ++c) at += wanted(r, c) * (target[static_cast<std::size_t>(c)] - pivot(c));
            solved_(r) = at;
        }
        manipulability = direction ? side / size : 0.0;
        error = 0.0;
        solved = direction && finite(solved_);
        if (!finite(solved_)) solved_ = measured_;
        for (std::size_t n = 0; n < 5; ++n) command[n] = solved_(static_cast<Eigen::Index>(n));
    }

    /// v = (right + left) / 2, w = (right - left) / track; the way of a cycle is an arc, taken by its chord.
    void move_drive(double dt) noexcept {
        const double width = track > 0.0 ? track.get() : 1.0, v = 0.5 * (measured_(0) + measured_(1)),
                     w = (measured_(1) - measured_(0)) / width;
        if (follow) x_ = y_ = heading_ = way_ = 0.0;
        const double turn = 0.5 * w * dt, chord = std::fabs(turn) > 1e-6 ? std::sin(turn) / turn : 1.0 - turn * turn / 6.0;
        x_ += v * dt * chord * std::cos(heading_ + turn);
        y_ += v * dt * chord * std::sin(heading_ + turn);
        heading_ = std::remainder(heading_ + w * dt, 2.0 * pi);
        way_ += std::fabs(v) * dt;
        const double shown[] = {x_, y_, heading_, v, w, way_};
        for (std::size_t i = 0; i < 6; ++i) place[i] = shown[i];
        command[0] = target[0] - 0.5 * width * target[1];
        command[1] = target[0] + 0.5 * width * target[1];
        solved = track > 0.0;
    }

    hal::TextArgument machine_;
    Machine           kind_ = Machine::arm;
    Arm               arm_;
    Vector            measured_, solved_;
    double            x_ = 0.0, y_ = 0.0, heading_ = 0.0, way_ = 0.0;

public:
    hal::Ins<double>          q, target;
    hal::Outs<double>         place, command;
    hal::In<bool>             follow{*this, "follow", "while TRUE the search starts at the measured joints; of the drive: the pose is 0"};
    hal::In<bool>             position_only{*this, "position-only", "arm: only x y z of the target count; for arms of fewer than 6 joints"};
    hal::Param<std::uint32_t> iterations{*this, "iterations", "arm: steps of the search in a cycle, up to 50", {.initial = 4}};
    hal::Param<double> damping{*this, "damping", "arm: the larger, the calmer near a singular place, and the slower", {.initial = 0.01}};
    hal::Param<double> tolerance{*this, "tolerance", "arm: solved when x y z and the turn are within", {.initial = 1e-6}};
    hal::Param<double> pivot_x{*this, "pivot-x", "mill: where A and C meet", {.unit = "m"}};
    hal::Param<double> pivot_y{*this, "pivot-y", "mill: where A and C meet", {.unit = "m"}};
    hal::Param<double> pivot_z{*this, "pivot-z", "mill: where A and C meet", {.unit = "m"}};
    hal::Param<double> tool_length{*this, "tool-length", "mill: from the spindle's nose to the tip", {.unit = "m"}};
    hal::Param<double> track{*this, "track", "drive: between the wheels", {.initial = 0.3, .unit = "m"}};
    hal::Out<bool>     solved{*this, "solved", "the commands do bring it to the target"};
    hal::Out<double>   error{*this, "error", "arm: what remains to the target"};
    hal::Out<double>   manipulability{*this, "manipulability", "0 at a singular place: an arm stretched out, a mill's tool upright"};
    hal::Out<std::uint32_t> bad_inputs{*this, "bad-inputs", "cycles with an input that was no number: all outputs stay"};
    hal::Function           run{*this, "update", &Kinematics::update, "where it is, and how to get to the target"};
};

}  // namespace

HAL_COMPONENT(Kinematics, "kinematics", "Joints to pose and pose to joints: serial arm, five-axis mill, two-wheeled drive", R"(
**machine=arm**: a serial arm of up to 8 joints by the table of Denavit and Hartenberg, a row per joint: a, alpha, d, theta (m, rad), and a 1 behind for a
joint that slides. `pose` is x y z roll pitch yaw (turns about the fixed x, y, z). `command` are the joints for `target`: `iterations` steps of damped least squares
a cycle, from where the last cycle ended, so a target that moves smoothly is followed; `solved` says when it is reached. `follow` starts from the
measured joints. Near singular places it slows down and does not jump. With fewer than 6 joints set `position-only`.

**machine=mill**: X Y Z move the tool, a table turns the workpiece by C about z on a trunnion that turns by A about x; both meet in `pivot`. Targets are the
tool's tip and direction in the workpiece's frame; of the two solutions the one nearer to the last C is taken, and C goes the shorter way round.

**machine=drive**: two driven wheels, `track` apart. Joints are the wheels' speeds; the pose is the odometry x y heading, forward and turning speed and way;
targets 0 and 1 are forward and turning speed, the commands the wheels'.

An input that is no number leaves all outputs as they are, and `solved` falls.

    loadrt kinematics names=scara machine=arm dh=0.3,0,0,0;0.2,0,0,0
    addf scara.update servo
    setp scara.position-only TRUE
    net shoulder => scara.joint-0
    net elbow    => scara.joint-1
    net reach    => scara.target-0
    net turn     <= scara.command-0
)")
