// SPDX-License-Identifier: MIT
#include <Eigen/LU>
#include <cmath>
#include <deque>
#include <optional>
#include <string>

#include "estimation/channels.hpp"
#include "estimation/design/plant.hpp"
#include "estimation/hold.hpp"
#include "estimation/matrices.hpp"
#include "estimation/past.hpp"
#include "hal/component.hpp"
#include "hal/retained.hpp"

namespace {

using namespace hal::estimation;

/// x(k+1) = Ax + Bu + w, z = Cx + v. The measurements are decorrelated when the matrices are read.
struct Linear {
    Matrix a, b, q, c;
    Vector r;

    void predict(Moment& to, const Moment& from) const noexcept {
        Vector pushed;
        multiply(to.x, a, from.x);
        multiply(pushed, b, to.u);
        to.x += pushed;
        propagate_covariance(to.p, a, from.p, q);
    }
    Correction measure(Moment& moment, Eigen::Index channel, double gate) const noexcept {
        const Vector row = c.row(channel).transpose();
        double innovation = moment.z(channel);
        for (Eigen::Index i = 0; i < row.size(); ++i) {
            innovation -= row(i) * moment.x(i);
        }
        return correct(moment.x, moment.p, row, innovation, r(channel), gate);
    }
};

/// The plant of the load arguments: x(k+1) = Ax + Bu + w or x' = Ax + Bu + w, z = Cx + v.
struct KalmanPlant {
    Time time = Time::discrete;
    Matrix a, b;
    Dense c;
    Matrix q;   ///< covariance of w; its density if the time is continuous
    Dense r;    ///< covariance of v
    Vector x0;  ///< initial estimate of x
    Matrix p0;  ///< covariance of the initial estimate
};

Time parse_time(const std::string& text) {
    if (text == "continuous") return Time::continuous;
    if (text == "discrete") return Time::discrete;
    throw hal::ArgumentError("plant", "plant=" + text + " is neither continuous nor discrete");
}

/// Returns a covariance of noise on the states; an element may be 0.
Dense state_covariance(const Matrices& matrices, const char* name, Eigen::Index states) {
    const Dense m = matrices.symmetric(name, states, "it has a row and a column per state",
                                       "a covariance matrix is symmetric");
    if (!m.isZero() && !is_positive_semidefinite(m)) {
        matrices.refuse(name, std::string(name) + " has a negative eigenvalue",
                        "a covariance matrix is positive semidefinite");
    }
    return m;
}

/// Returns the covariance of the noise on the measurements; all have noise.
Dense measurement_covariance(const Matrices& matrices, const char* name,
                             Eigen::Index measurements) {
    const Dense m = matrices.symmetric(name, measurements,
                                       "it has a row and a column per measurement, as C has rows",
                                       "a covariance matrix is symmetric");
    if (m.diagonal().minCoeff() <= 0.0) {
        matrices.refuse(name, std::string(name) + " is not positive",
                        "give each measurement's variance on the diagonal, above 0");
    }
    if (!is_positive_definite(m)) {
        matrices.refuse(name, std::string(name) + " is not positive definite",
                        "the noise of one measurement follows from those of others; give smaller "
                        "covariances beside the diagonal");
    }
    return m;
}

/// Rejects a plant with an unstable mode that no measurement shows: its estimate would diverge.
void check_detectable(const Matrices& matrices, const KalmanPlant& plant) {
    const std::optional<Mode> mode = unseen(Dense(plant.a), plant.c, plant.time);
    if (!mode) return;
    matrices.refuse("C",
                    "the plant is undetectable: no measurement shows its mode at " +
                        text(mode->value) + ", strongest in state " + std::to_string(mode->state),
                    "that mode is unstable, so its estimate would diverge; measure it, or "
                    "remove the state");
}

/// Reads the load arguments of a component. Throws for an invalid one. [setup]
KalmanPlant read_plant(hal::Component& component, const std::string& time) {
    KalmanPlant plant;
    plant.time = parse_time(time);
    const Matrices matrices(
        component, {{"A", "1,0.001;0,1", "n x n: system matrix"},
                    {"B", "0;0.001", "n x m: input matrix; default: no inputs"},
                    {"C", "1,0", "p x n: measurement matrix"},
                    {"QN", "1e-12,0;0,1e-6", "n x n: covariance of the noise on the states"},
                    {"RN", "1e-6", "p x p: covariance of the noise on the measurements"},
                    {"P0", "", "n x n: initial covariance of the states; default: identity"},
                    {"x0", "", "n: initial states; default: 0"}});
    plant.a = matrices.square("A");
    const Eigen::Index states = plant.a.rows();
    plant.b = Dense::Zero(states, 0);
    if (matrices.has("B")) {
        plant.b = matrices.with_rows("B", states, "it has a row per state, as A has");
    }
    plant.c = matrices.with_columns("C", states, "it has a column per state, as A has");
    plant.q = state_covariance(matrices, "QN", states);
    plant.r = measurement_covariance(matrices, "RN", plant.c.rows());
    plant.p0 = Matrix::Identity(states, states);
    if (matrices.has("P0")) {
        plant.p0 = state_covariance(matrices, "P0", states);
    }
    plant.x0 = Vector::Zero(states);
    if (matrices.has("x0")) {
        plant.x0 = matrices.vector("x0", states, "it has a number per state");
    }
    check_detectable(matrices, plant);
    return plant;
}

/// For measurements z whose noises depend on each other: the noises of transform * z are
/// independent, so that one of them can be applied after the other.
struct Decorrelation {
    Matrix transform;
    Vector variances;  ///< of the noises of transform * z
};

/// R = L D L' gives the transform L^-1 and the variances D. [setup]
Decorrelation decorrelate(const Dense& r) {
    const Eigen::Index p = r.rows();
    Dense l = Dense::Identity(p, p);
    Vector d = Vector::Zero(p);
    for (Eigen::Index j = 0; j < p; ++j) {
        d(j) = r(j, j);
        for (Eigen::Index k = 0; k < j; ++k) {
            d(j) -= l(j, k) * l(j, k) * d(k);
        }
        for (Eigen::Index i = j + 1; i < p; ++i) {
            double sum = r(i, j);
            for (Eigen::Index k = 0; k < j; ++k) {
                sum -= l(i, k) * l(j, k) * d(k);
            }
            l(i, j) = sum / d(j);
        }
    }
    Dense inverse = Dense::Identity(p, p);
    for (Eigen::Index i = 0; i < p; ++i) {
        for (Eigen::Index k = 0; k < i; ++k) {
            inverse.row(i) -= l(i, k) * inverse.row(k);
        }
    }
    return {inverse, d};
}

std::optional<Decorrelation> decorrelation_of(const Dense& r) {
    if (r.isDiagonal(1e-14)) return std::nullopt;
    return decorrelate(r);
}

/// Returns the model of a plant, whose matrices A, B and Q are not sampled yet. [setup]
Linear model_of(const KalmanPlant& plant, const std::optional<Decorrelation>& decorrelation) {
    Linear model{plant.a, plant.b, plant.q, plant.c, plant.r.diagonal()};
    if (decorrelation) {
        model.c = Dense(decorrelation->transform) * plant.c;
        model.r = decorrelation->variances;
    }
    return model;
}

class Kalman : public hal::Component {
public:
    explicit Kalman(const hal_host* host)
        : Component(host),
          time_(*this, "plant", "discrete",
                "discrete: x(k+1) = Ax + Bu, a step per cycle; continuous: x' = Ax + Bu, QN is "
                "the density of its noise"),
          history_(
              *this, "history", 32,
              "length of the history in cycles; measurements may be up to history - 2 cycles old",
              {.min = 3, .max = 4096}),
          plant_(read_plant(*this, time_.get())),
          decorrelation_(decorrelation_of(plant_.r)),
          gain_of_covariance_(plant_.c.transpose() * plant_.r.inverse()),
          model_(model_of(plant_, decorrelation_)),
          past_(model_, static_cast<std::size_t>(history_), plant_.x0, plant_.p0, model_.b.cols(),
                model_.c.rows()),
          u(*this, "u-#", model_.b.cols(), "input # of the plant since the previous cycle"),
          channels_(*this, model_.c.rows()),
          x(*this, "x-#", model_.a.rows(), "state #, estimated", {.finite = true}),
          sigma(*this, "sigma-#", model_.a.rows(), "standard deviation of state #",
                {.finite = true}) {
        for (Eigen::Index i = 0; i < model_.a.rows(); ++i) {
            for (Eigen::Index j = 0; j < model_.c.rows(); ++j) {
                gains_.emplace_back(*this,
                                    ("gain-" + std::to_string(i) + "-" + std::to_string(j)).c_str(),
                                    ("effect of measurement " + std::to_string(j) + " on state " +
                                     std::to_string(i) + ", with show-gains")
                                        .c_str());
            }
        }
        input_ = Vector::Zero(model_.b.cols());
        hal::Retained(*this, {{"input", input_}});
        past_.retain(*this);
    }

    void update(hal::Cycle cycle) noexcept {
        if (cycle.period_ns() != period_ns_) {
            if (plant_.time == Time::continuous && period_ns_ != 0) {
                past_.restart();
            }
            sample(cycle);
        }
        if (reset) {
            past_.restart();
        }
        for (std::size_t i = 0; i < u.size(); ++i) {
            if (const double value = u[i]; std::isfinite(value)) {
                input_(static_cast<Eigen::Index>(i)) = value;
            }
        }
        past_.advance(input_);
        if (decorrelation_) {
            channels_.feed_decorrelated(past_, cycle, decorrelation_->transform);
        } else {
            channels_.feed(past_, cycle);
        }
        past_.settle(std::fmax(channels_.gate, 0.0));
        channels_.show_outcome(past_, cycle);
        const Moment& now = past_.now();
        for (std::size_t i = 0; i < x.size(); ++i) {
            const auto at = static_cast<Eigen::Index>(i);
            x[i] = now.x(at);
            sigma[i] = std::sqrt(std::fmax(now.p(at, at), 0.0));
        }
        if (show_gains) {
            show_gain(now);
        }
    }

private:
    /// Samples a continuous plant for the period of the cycle. [realtime]
    void sample(hal::Cycle cycle) noexcept {
        period_ns_ = cycle.period_ns();
        if (plant_.time == Time::discrete) return;
        model_.a = plant_.a;
        model_.b = plant_.b;
        model_.q = plant_.q;
        hold_.sample(model_.a, model_.b, cycle.seconds());
        hold_.sample_noise(plant_.a, model_.q, cycle.seconds());
    }
    /// Shows the gain P C' R^-1 of the measurements as they are given. [realtime]
    void show_gain(const Moment& now) noexcept {
        Matrix gain;
        multiply(gain, now.p, gain_of_covariance_);
        for (Eigen::Index i = 0, k = 0; i < gain.rows(); ++i) {
            for (Eigen::Index j = 0; j < gain.cols(); ++j, ++k) {
                gains_[static_cast<std::size_t>(k)] = gain(i, j);
            }
        }
    }

    hal::TextArgument time_;
    hal::Argument history_;
    const KalmanPlant plant_;
    // if the noises depend on each other: the measurements of a cycle are applied all or not at all
    const std::optional<Decorrelation> decorrelation_;
    const Matrix gain_of_covariance_;  // C' R^-1: the gain is that behind the covariance P
    Vector input_;
    Linear model_;
    Past<Linear> past_;
    Hold hold_;
    std::int64_t period_ns_ = 0;

public:
    hal::Ins<double> u;

private:
    Channels channels_;

public:
    hal::Outs<double> x, sigma;
    hal::In<bool> reset{
        *this, "reset",
        "TRUE resets the estimate to its initial value, corrected by the current measurements"};
    hal::Param<bool> show_gains{*this, "show-gains", "TRUE computes gain-I-J in each cycle"};
    hal::Function run{*this, "update", &Kalman::update,
                      "predicts one period and applies the measurements"};

private:
    std::deque<hal::Out<double>> gains_;
};

}  // namespace

HAL_COMPONENT(Kalman, "kalman", "Kalman filter of a linear plant, with late measurements", R"(
    x(k+1) = A x + B u + w,  z = C x + v,   w with covariance QN, v with RN

(R. Kalman, *A New Approach to Linear Filtering and Prediction Problems*, 1960.) Up to 12 states,
inputs and measurements; their numbers follow from the matrices, which are load arguments or in a
`file=` (see state_space). With `plant=continuous` A and B are those of x' = Ax + Bu and QN is the
density of its noise; all three are converted to the thread's period in its first cycle.

`x-N` is the estimate at the end of the cycle, `sigma-N` its standard deviation. Add the function
after the measurements and before the controller; `u-N` is then the controller's output of the
previous cycle, which acted in between.

**Late measurements.** `age-N` is the age of `z-N` in seconds. The filter keeps the last `history`
cycles; a late measurement is applied at its own time and all later steps are repeated, so the
estimate is as good as with a measurement in time. A cycle runs one step plus one per cycle of age
of its oldest measurement. `new-N` is TRUE if the cycle has a measurement: for sensors slower than
the thread.

**Invalid measurements** are ignored and counted: NaN and infinity in `skipped`; older than the
history in `late`; a deviation above `gate` standard deviations in `outliers` (0: no gate). `valid`
becomes FALSE if no measurement was used for `timeout` (0: no timeout). The covariance is updated by
Joseph's form, which keeps it symmetric and positive; should it become invalid nevertheless, it is
reset to P0 and `renewals` increases. If RN has correlated noise, measurements are used only if all
of them are present.

A plant with an unstable mode that is not observable is rejected; the error names the mode.

    # position measured each millisecond, 3 ms late; speed wanted
    loadrt kalman names=sled a=1,0.001;0,1 b=0;0.001 c=1,0 qn=1e-12,0;0,1e-6 rn=1e-6
    addf sled.update servo
    setp sled.age-0 0.003
    net place   => sled.z-0
    net thrust  => sled.u-0
    net speed   <= sled.x-1
)")
