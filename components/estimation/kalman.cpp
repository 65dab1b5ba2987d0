// SPDX-License-Identifier: MIT
#include <Eigen/LU>
#include <cmath>
#include <deque>

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

class Kalman : public hal::Component {
public:
    explicit Kalman(const hal_host* host)
        : Component(host),
          plant_(*this, "plant", "discrete",
                 "discrete: x(k+1) = Ax + Bu, a step per cycle; continuous: x' = Ax + Bu, QN is "
                 "the density of its noise"),
          history_(
              *this, "history", 32,
              "length of the history in cycles; measurements may be up to history - 2 cycles old",
              {.min = 3, .max = 4096}),
          model_(read()),
          past_(model_, static_cast<std::size_t>(history_), x0_, p0_, model_.b.cols(),
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
            if (continuous_ && period_ns_ != 0) {
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
        if (whole_ == nullptr) {
            channels_.feed(past_, cycle);
        } else {
            channels_.feed_decorrelated(past_, cycle, *whole_);
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
            show(now);
        }
    }

private:
    /// Reads the load arguments. Throws hal::ArgumentError for an invalid one. [setup]
    Linear read() {
        continuous_ = plant_.get() == "continuous";
        if (!continuous_ && plant_.get() != "discrete") {
            throw hal::ArgumentError(
                "plant", "plant=" + plant_.get() + " is neither continuous nor discrete");
        }
        const Matrices given(
            *this, {{"A", "1,0.001;0,1", "n x n: system matrix"},
                    {"B", "0;0.001", "n x m: input matrix; default: no inputs"},
                    {"C", "1,0", "p x n: measurement matrix"},
                    {"QN", "1e-12,0;0,1e-6", "n x n: covariance of the noise on the states"},
                    {"RN", "1e-6", "p x p: covariance of the noise on the measurements"},
                    {"P0", "", "n x n: initial covariance of the states; default: identity"},
                    {"x0", "", "n: initial states; default: 0"}});
        Linear model;
        model.a = a_ = given.square("A");
        const Eigen::Index n = model.a.rows();
        model.b = b_ = given.has("B") ? given.at("B", n, given.at("B").value.cols(),
                                                 "it has a row per state, as A has")
                                      : Dense(Dense::Zero(n, 0));
        Dense c =
            given.at("C", given.at("C").value.rows(), n, "it has a column per state, as A has");
        const Eigen::Index p = c.rows();
        model.q = q_ = covariance(given, "QN", n, "it has a row and a column per state", true);
        const Dense r = covariance(
            given, "RN", p, "it has a row and a column per measurement, as C has rows", false);
        p0_ = given.has("P0")
                  ? Matrix(covariance(given, "P0", n, "it has a row and a column per state", true))
                  : Matrix(Matrix::Identity(n, n));
        x0_ = given.has("x0") ? Vector(given.vector("x0", n, "it has a number per state"))
                              : Vector(Vector::Zero(n));
        if (const auto mode =
                unseen(Dense(model.a), c, continuous_ ? Time::continuous : Time::discrete)) {
            given.refuse("C",
                         "the plant is undetectable: no measurement shows its mode at " +
                             text(mode->value) + ", strongest in state " +
                             std::to_string(mode->state),
                         "that mode is unstable, so its estimate would diverge; measure it, or "
                         "remove the state");
        }
        shown_ = c.transpose() * r.inverse();
        if (!r.isDiagonal(1e-14)) {
            whole_ = &whole_matrix_;
            whole_matrix_ = independent(r);
        }
        if (whole_ != nullptr) {
            c = Dense(whole_matrix_) * c;
        }
        model.c = c;
        model.r = whole_ != nullptr ? Vector(spread_) : Vector(r.diagonal());
        return model;
    }
    static Dense covariance(const Matrices& given, const char* name, Eigen::Index n,
                            const char* why, bool semi) {
        const Dense m = given.at(name, n, n, why);
        if ((m - m.transpose()).norm() > 1e-12 * m.norm()) {
            given.refuse(name, std::string(name) + " is not symmetric",
                         "a covariance matrix is symmetric");
        }
        if (!positive(m, semi) && !(semi && m.isZero())) {
            given.refuse(
                name,
                std::string(name) + (semi ? " has a negative eigenvalue" : " is not positive"),
                semi ? "a covariance matrix is positive semidefinite"
                     : "give each measurement's variance on the diagonal, above 0");
        }
        return m;
    }
    /// L^-1 of R = L D L', so that the noise of L^-1 z is independent, with the variances D in
    /// spread_.
    Matrix independent(const Dense& r) {
        const Eigen::Index p = r.rows();
        Dense l = Dense::Identity(p, p);
        Dense inverse = l;
        spread_ = Vector::Zero(p);
        for (Eigen::Index j = 0; j < p; ++j) {
            double d = r(j, j);
            for (Eigen::Index k = 0; k < j; ++k) {
                d -= l(j, k) * l(j, k) * spread_(k);
            }
            spread_(j) = d;
            for (Eigen::Index i = j + 1; i < p; ++i) {
                double sum = r(i, j);
                for (Eigen::Index k = 0; k < j; ++k) {
                    sum -= l(i, k) * l(j, k) * spread_(k);
                }
                l(i, j) = sum / d;
            }
        }
        for (Eigen::Index i = 0; i < p; ++i) {
            for (Eigen::Index k = 0; k < i; ++k) {
                inverse.row(i) -= l(i, k) * inverse.row(k);
            }
        }
        return inverse;
    }
    void sample(hal::Cycle cycle) noexcept {
        period_ns_ = cycle.period_ns();
        if (!continuous_) return;
        model_.a = a_;
        model_.b = b_;
        model_.q = q_;
        hold_.sample(model_.a, model_.b, cycle.seconds());
        hold_.sample_noise(a_, model_.q, cycle.seconds());
    }
    void show(const Moment& now) noexcept {
        Matrix gain;
        multiply(gain, now.p, shown_);
        for (Eigen::Index i = 0, k = 0; i < gain.rows(); ++i) {
            for (Eigen::Index j = 0; j < gain.cols(); ++j, ++k) {
                gains_[static_cast<std::size_t>(k)] = gain(i, j);
            }
        }
    }

    hal::TextArgument plant_;
    hal::Argument history_;
    bool continuous_ = false;
    Vector x0_, spread_, input_;
    Matrix a_, b_, q_, p0_, shown_, whole_matrix_;
    // set: the measurements' noises depend on each other, only all of them together can be taken
    const Matrix* whole_ = nullptr;
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
