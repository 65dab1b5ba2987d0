// SPDX-License-Identifier: MIT
// Identifies the rig of a Furuta pendulum while it moves: recursive least squares (L. Ljung, System
// Identification, 2nd ed., 11.2) on the two equations of motion, each divided by what makes it
// linear in its unknowns. With q the angle of the arm, a that of the pendulum:
//     a" - ½ sin 2a q'²  =  - (c/K) cos a q"  - (w/K) cos a₀ sin a  + (w/K) sin a₀ cos a          unknown: c/K, (w/K) cos a₀, (w/K) sin a₀
//     torque  =  J q"  +  K (sin²a q" + sin 2a q' a' + (c/K) (cos a a" - sin a a'²))  +  F tanh(q'/0.05)   unknown: J, K, F
// a₀ is the angle that the encoder gives for a hanging pendulum; it is 0 when the encoder has been
// homed. Every term passes the same triangular filter, so that the accelerations may be second
// differences of positions.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace hal::estimation {

/// The rig parameters for a controller, in SI units; torques are commanded torques.
struct FurutaParameters {
    double arm_inertia = 0;
    double pendulum_inertia = 0;
    double coupling = 0;
    double weight_moment = 0;
    double friction = 0;
    bool operator==(const FurutaParameters&) const = default;
};

/// The average of a signal over the last 60 ms with triangular weights: two moving averages of half
/// the length in series.
class TriangularFilter {
public:
    static constexpr std::size_t max = 64;
    /// [realtime]
    void restart(std::size_t length) noexcept {
        *this = {};
        length_ = std::clamp<std::size_t>(length, 1, max);
    }
    double pass(double value) noexcept {
        for (auto& stage : stages_) {
            stage.sum += value - stage.last[at_];
            stage.last[at_] = value;
            value = stage.sum / static_cast<double>(length_);
        }
        at_ = (at_ + 1) % length_;
        return value;
    }

private:
    struct Stage {
        std::array<double, max> last{};
        double sum = 0;
    };
    std::array<Stage, 2> stages_{};
    std::size_t length_ = 1;
    std::size_t at_ = 0;
};

/// Recursive least squares with three unknowns and an initial estimate. The weight of a residual
/// far beyond the noise is linear, not quadratic.
class RecursiveLeastSquares {
public:
    static constexpr bool retainable = true;
    using Vector = Eigen::Vector3d;
    void restart(const Vector& estimate, const Vector& deviation, double noise) noexcept {
        estimate_ = estimate;
        covariance_ = deviation.cwiseAbs2().asDiagonal();
        noise_ = noise;
        count_ = 0;
    }
    /// [realtime]
    void add(const Vector& regressor, double value) noexcept {
        const double residual = value - regressor.dot(estimate_);
        if (!std::isfinite(residual)) return;
        const double excess = std::max(1.0, std::fabs(residual) / (3.0 * noise_));
        const Vector spread = covariance_ * regressor;
        const double variance = noise_ * noise_ * excess + regressor.dot(spread);
        estimate_ += spread * (residual / variance);
        covariance_ -= spread * spread.transpose() / variance;
        ++count_;
    }
    const Vector& estimate() const noexcept { return estimate_; }
    double deviation(int i) const noexcept { return std::sqrt(std::max(covariance_(i, i), 0.0)); }
    std::uint64_t count() const noexcept { return count_; }

private:
    Vector estimate_ = Vector::Zero();
    Eigen::Matrix3d covariance_ = Eigen::Matrix3d::Identity();
    double noise_ = 1;
    std::uint64_t count_ = 0;
};

class FurutaIdentification {
public:
    static constexpr bool retainable = true;
    /// Begins anew with what the user gave. [realtime]
    void restart(const FurutaParameters& nominal, double dt) noexcept {
        nominal_ = nominal;
        dt_ = dt;
        half_ = std::clamp<std::size_t>(static_cast<std::size_t>(std::lround(0.03 / dt)), 2,
                                        TriangularFilter::max);
        const double K = nominal.pendulum_inertia;
        const double ratio = nominal.coupling / K;

        const double stiffness = nominal.weight_moment / K;
        swing_.restart({ratio, stiffness, 0.0}, {0.4 * ratio, 0.4 * stiffness, stiffness},
                       0.12 * stiffness);
        drive_.restart({nominal.arm_inertia, K, nominal.friction},
                       {0.4 * nominal.arm_inertia, 0.4 * K, nominal.friction + 1e-9},
                       0.2 * nominal.weight_moment);
        forget_motion();
    }
    const FurutaParameters& nominal() const noexcept { return nominal_; }
    double dt() const noexcept { return dt_; }

    /// After a measurement that is not part of the motion. [realtime]
    void forget_motion() noexcept {
        for (auto& filter : swing_filters_) {
            filter.restart(half_);
        }
        for (auto& filter : drive_filters_) {
            filter.restart(half_);
        }
        samples_ = 0;
    }

    struct Sample {
        double arm, pendulum, arm_speed, pendulum_speed, torque;
    };
    /// One cycle's measurements, the pendulum's `age` behind the arm's (s). `driven`: the motor
    /// makes the torque. [realtime]
    void add(const Sample& now, double age, bool driven) noexcept {
        const auto late = std::min<std::size_t>(
            static_cast<std::size_t>(std::lround(std::max(age - dt_, 0.0) / dt_)),
            delay_.size() / 2);
        const auto before = [&](std::size_t count) -> const Arm& {
            return delay_[(samples_ - std::min<std::uint64_t>(count, samples_)) % delay_.size()];
        };
        delay_[samples_ % delay_.size()] = {now.arm, now.arm_speed, now.torque};
        const Arm& arm = before(late);
        const double commanded = before(late + winding).torque;
        ++samples_;
        const double q2 = (arm.angle - 2 * arm_[0] + arm_[1]) / (dt_ * dt_);

        const double a2 = (now.pendulum - 2 * pendulum_[0] + pendulum_[1]) / (dt_ * dt_);
        const double a = pendulum_[0];
        const double w = pendulum_speed_;
        const double v = arm_speed_;
        const double torque = torque_;
        arm_ = {arm.angle, arm_[0]};
        pendulum_ = {now.pendulum, pendulum_[0]};
        pendulum_speed_ = now.pendulum_speed;
        arm_speed_ = arm.speed;
        torque_ = commanded;
        if (samples_ < 3 + late) return;
        const double sin = std::sin(a);
        const double cos = std::cos(a);
        const double ratio = swing_.estimate()[0];
        const Eigen::Vector3d swing{swing_filters_[0].pass(-cos * q2), swing_filters_[1].pass(-sin),
                                    swing_filters_[2].pass(cos)};
        const double swung = swing_filters_[3].pass(a2 - sin * cos * v * v);
        const Eigen::Vector3d drive{drive_filters_[0].pass(q2),
                                    drive_filters_[1].pass(sin * sin * q2 + 2 * sin * cos * v * w +
                                                           ratio * (cos * a2 - sin * w * w)),
                                    drive_filters_[2].pass(std::tanh(v / 0.05))};
        const double driving = drive_filters_[3].pass(torque);
        driven_ = driven ? driven_ + 1 : 0;
        // every 15 ms: neighbours hardly differ
        if (samples_ < 2 * half_ + 3 + late || samples_ % (half_ / 2) != 0) return;
        swing_.add(swing, swung);
        if (driven_ > 2 * half_ + late) {
            drive_.add(drive, driving);
        }
    }

    /// The rig as identified so far, each quantity between a quarter and four times what the user
    /// gave. [realtime]
    FurutaParameters estimate() const noexcept {
        const auto bounded = [](double value, double nominal) {
            return std::clamp(value, 0.25 * nominal, 4.0 * nominal);
        };
        FurutaParameters p;
        p.arm_inertia = bounded(drive_.estimate()[0], nominal_.arm_inertia);
        p.pendulum_inertia = bounded(drive_.estimate()[1], nominal_.pendulum_inertia);
        p.friction = std::clamp(drive_.estimate()[2], 0.0, 3.0 * nominal_.friction);
        p.coupling = p.pendulum_inertia *
                     bounded(swing_.estimate()[0], nominal_.coupling / nominal_.pendulum_inertia);
        p.weight_moment = p.pendulum_inertia *
                          bounded(stiffness(), nominal_.weight_moment / nominal_.pendulum_inertia);
        return p;
    }

    /// a₀, rad. [realtime]
    double zero_offset() const noexcept {
        return std::atan2(swing_.estimate()[2], swing_.estimate()[1]);
    }
    /// a₀ is known well enough, and it is not 0. [realtime]
    bool zero_is_wrong() const noexcept {
        return swing_.count() >= 5 && swing_.deviation(2) < 0.08 * stiffness() &&
               std::fabs(zero_offset()) > 0.3;
    }

private:
    /// Cycles from a torque's command to its middle: the command is for the next period, and the
    /// winding delays it by about one.
    static constexpr std::size_t winding = 2;
    struct Arm {
        double angle, speed, torque;
    };
    double stiffness() const noexcept {
        return std::hypot(swing_.estimate()[1], swing_.estimate()[2]);
    }

    FurutaParameters nominal_;
    double dt_ = 0;
    std::size_t half_ = 2;
    std::uint64_t samples_ = 0;
    std::uint64_t driven_ = 0;
    std::array<Arm, 64> delay_{};
    std::array<double, 2> arm_{}, pendulum_{};
    double arm_speed_ = 0;
    double pendulum_speed_ = 0;
    double torque_ = 0;
    std::array<TriangularFilter, 4> swing_filters_, drive_filters_;
    RecursiveLeastSquares swing_, drive_;
};

}  // namespace hal::estimation
