// SPDX-License-Identifier: MIT
#include <cmath>
#include <complex>
#include <optional>
#include <string>

#include "estimation/design/plant.hpp"
#include "estimation/matrices.hpp"
#include "hal/component.hpp"
#include "hal/retained.hpp"

namespace {

using namespace hal::estimation;

/// x(k+1) = Ax + Bu, corrected by L (z - C x(k+1)).
struct Observer {
    Matrix a, b, c, l;
    Vector x0;  ///< initial x
};

/// Returns the gain that the user gives. The correction follows the prediction: the error is
/// multiplied by (I - LC) A per step, which has to be stable.
Dense read_gain(const Matrices& matrices, const Dense& a, const Dense& c) {
    const Dense l =
        matrices.at("L", a.rows(), c.rows(), "it has a row per state and a column per measurement");
    const double radius = spectral_radius(a - l * c * a);
    if (radius >= 1.0) {
        matrices.refuse("L",
                        "with this gain the observer is unstable: its largest pole is " +
                            std::to_string(radius),
                        "use poles= instead of L=");
    }
    return l;
}

/// Returns the gain that gives the error the poles of the user.
Dense place_gain(const Matrices& matrices, const Dense& a, const Dense& c) {
    const Eigen::VectorXd poles = matrices.vector("poles", a.rows(), "one for each state");
    if (poles.cwiseAbs().maxCoeff() >= 1.0) {
        matrices.refuse("poles", "a pole is outside of the unit circle",
                        "use poles between 0 and 1: 0 settles in one cycle, 0.99 in some hundred");
    }
    const std::optional<Dense> l = place_observer(a, c * a, poles.cast<std::complex<double>>());
    if (!l) {
        matrices.refuse("C",
                        "the plant is not observable, or a pole of the observer is one of its own",
                        "look at C, or change the poles slightly");
    }
    return *l;
}

/// Reads the load arguments. Throws for an invalid one. [setup]
Observer read_observer(hal::Component& component) {
    const Matrices matrices(component, {{"A", "1,0.001;0,1", "n x n: x(k+1) = Ax + Bu"},
                                        {"B", "0;0.001", "n x m; default: no inputs"},
                                        {"C", "1,0", "p x n: z = Cx"},
                                        {"L", "", "n x p: gain; alternatively poles"},
                                        {"poles", "0.95,0.9",
                                         "n: poles of the error; real, inside of the unit circle; "
                                         "distinct if there is one measurement"},
                                        {"x0", "", "n: initial states; default: 0"}});
    const Dense& a = matrices.square("A");
    const Eigen::Index states = a.rows();
    Dense b = Dense::Zero(states, 0);
    if (matrices.has("B")) {
        b = matrices.with_rows("B", states, "it has a row per state, as A has");
    }
    const Dense c = matrices.with_columns("C", states, "it has a column per state, as A has");
    Vector x0 = Vector::Zero(states);
    if (matrices.has("x0")) {
        x0 = matrices.vector("x0", states, "it has a number per state");
    }
    const Dense l = matrices.has("L") ? read_gain(matrices, a, c) : place_gain(matrices, a, c);
    return {a, b, c, l, x0};
}

class Luenberger : public hal::Component {
public:
    explicit Luenberger(const hal_host* host)
        : Component(host),
          model_(read_observer(*this)),
          u(*this, "u-#", model_.b.cols(), "input # of the plant since the previous cycle"),
          z(*this, "z-#", model_.c.rows(), "measurement #"),
          x(*this, "x-#", model_.a.rows(), "state #, estimated", {.finite = true}),
          innovation(*this, "innovation-#", model_.c.rows(),
                     "measurement # minus its expected value") {
        state_ = model_.x0;
        hal::Retained(*this, {{"state", state_}});
    }

    void update(hal::Cycle) noexcept {
        Vector next, pushed, expected, corrected, input(static_cast<Eigen::Index>(u.size())),
            off(static_cast<Eigen::Index>(z.size()));
        for (std::size_t i = 0; i < u.size(); ++i) {
            input(static_cast<Eigen::Index>(i)) = std::isfinite(u[i]) ? u[i].get() : 0.0;
        }
        multiply(next, model_.a, state_);
        multiply(pushed, model_.b, input);
        next += pushed;
        multiply(expected, model_.c, next);
        for (std::size_t i = 0; i < z.size(); ++i) {
            const auto at = static_cast<Eigen::Index>(i);
            const double value = z[i];
            if (!std::isfinite(value)) {
                skipped = skipped + 1;
            }
            off(at) = std::isfinite(value) ? value - expected(at) : 0.0;
            innovation[i] = off(at);
        }
        multiply(corrected, model_.l, off);
        next += corrected;
        if (reset) {
            next = model_.x0;
        }
        if (finite(next)) {
            state_ = next;
        } else {
            state_ = model_.x0;
            restarts = restarts + 1;
        }
        for (std::size_t i = 0; i < x.size(); ++i) {
            x[i] = state_(static_cast<Eigen::Index>(i));
        }
    }

private:
    const Observer model_;
    Vector state_;

public:
    hal::Ins<double> u, z;
    hal::Outs<double> x, innovation;
    hal::In<bool> reset{*this, "reset", "TRUE sets the states to x0"};
    hal::Out<std::uint32_t> skipped{*this, "skipped",
                                    "number of NaN or infinite measurements; they are ignored"};
    hal::Out<std::uint32_t> restarts{*this, "restarts",
                                     "number of times the states overflowed and were reset to x0"};
    hal::Function run{*this, "update", &Luenberger::update,
                      "predicts one period and applies the measurements"};
};

}  // namespace

HAL_COMPONENT(Luenberger, "luenberger", "Luenberger observer with a given gain or given poles", R"(
    xm = A x + B u,   x = xm + L (z - C xm)

(D. Luenberger, *Observing the State of a Linear System*, 1964, in the form that uses the newest
measurement at once.) The error of the estimate is multiplied by (I - LC) A in each cycle; `poles`
are the eigenvalues of that matrix, and L follows from them. A plant that is not observable with
these measurements is rejected, and so is an L that makes the observer unstable. Matrices are given
as in state_space.

Use it instead of kalman if poles are known rather than noise; it also needs less time. NaN and
infinite measurements are ignored.

    loadrt luenberger names=sled a=1,0.001;0,1 b=0;0.001 c=1,0 poles=0.9,0.95
    addf sled.update servo
    net place  => sled.z-0
    net thrust => sled.u-0
    net speed  <= sled.x-1
)")
