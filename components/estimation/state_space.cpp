// SPDX-License-Identifier: MIT
#include <cmath>

#include "estimation/design/plant.hpp"
#include "estimation/hold.hpp"
#include "estimation/matrices.hpp"
#include "hal/component.hpp"
#include "hal/retained.hpp"

namespace {

using namespace hal::estimation;

struct StateSpace : hal::Component {
    explicit StateSpace(const hal_host* host)
        : Component(host),
          plant(*this, "plant", "continuous",
                "continuous: x' = Ax + Bu; discrete: x(k+1) = Ax + Bu, a step per cycle"),
          model_(read()),
          u(*this, "u-#", model_.b.cols(), "input #"),
          y(*this, "y-#", model_.c.rows(), "output #: row # of Cx + Du", {.finite = true}),
          x(*this, "x-#", model_.a.rows(), "state #", {.finite = true}) {
        for (std::size_t i = 0; i < x.size(); ++i) {
            x[i] = state_(static_cast<Eigen::Index>(i));
        }
        hal::Retained(*this, {{"state", state_}, {"input", input_}});
    }

    hal::TextArgument plant;

private:
    struct Model {
        Matrix a, b, c, d;
    };
    bool continuous_ = true;  // before the model: reading that sets these
    Vector start_, state_, input_;
    Model model_;
    Matrix sampled_a_, sampled_b_;
    hal::estimation::Hold hold_;
    std::int64_t period_ns_ = 0;

public:
    hal::Ins<double> u;
    hal::Outs<double> y, x;
    hal::In<bool> reset{*this, "reset", "TRUE sets the states to x0"};
    hal::Out<std::uint32_t> bad_inputs{
        *this, "bad-inputs", "number of NaN or infinite inputs; the previous input is used"};
    hal::Out<std::uint32_t> restarts{*this, "restarts",
                                     "number of times the states overflowed and were reset to x0"};
    hal::Function run{*this, "update", &StateSpace::update,
                      "computes the states and outputs after one period"};

    void update(hal::Cycle cycle) noexcept {
        if (cycle.period_ns() != period_ns_) {
            sample(cycle);
        }
        for (std::size_t i = 0; i < u.size(); ++i) {
            const double value = u[i];
            if (std::isfinite(value)) {
                input_(static_cast<Eigen::Index>(i)) = value;
            } else {
                bad_inputs = bad_inputs + 1;
            }
        }
        if (reset) {
            state_ = start_;
        } else {
            step();
        }
        Vector out, through;
        multiply(out, model_.c, state_);
        multiply(through, model_.d, input_);
        out += through;
        if (!finite(out)) {
            out.setZero();
        }
        for (std::size_t i = 0; i < y.size(); ++i) {
            y[i] = out(static_cast<Eigen::Index>(i));
        }
        for (std::size_t i = 0; i < x.size(); ++i) {
            x[i] = state_(static_cast<Eigen::Index>(i));
        }
    }

private:
    Model read() {
        const bool continuous = plant.get() == "continuous";
        if (!continuous && plant.get() != "discrete") {
            throw hal::ArgumentError(
                "plant", "plant=" + plant.get() + " is neither continuous nor discrete");
        }
        continuous_ = continuous;
        const Matrices given(
            *this, {{"A", "0,1;-1,-1", "n x n: system matrix"},
                    {"B", "0;1", "n x m: input matrix"},
                    {"C", "1,0", "p x n: output matrix; default: the outputs are the states"},
                    {"D", "", "p x m: feedthrough matrix; default: 0"},
                    {"x0", "", "n: initial states; default: 0"}});
        Model model;
        model.a = given.square("A");
        const auto n = model.a.rows();
        model.b = given.with_rows("B", n, "it has a row per state, as A has");
        model.c = Matrix::Identity(n, n);
        if (given.has("C")) {
            model.c = given.with_columns("C", n, "it has a column per state");
        }
        model.d = Matrix::Zero(model.c.rows(), model.b.cols());
        if (given.has("D")) {
            model.d = given.at("D", model.c.rows(), model.b.cols(),
                               "it has a row per output and a column per input");
        }
        start_ = Vector::Zero(n);
        if (given.has("x0")) {
            start_ = given.vector("x0", n, "it has a number per state");
        }
        state_ = start_;
        input_ = Vector::Zero(model.b.cols());
        return model;
    }
    void sample(hal::Cycle cycle) noexcept {
        period_ns_ = cycle.period_ns();
        sampled_a_ = model_.a;
        sampled_b_ = model_.b;
        if (continuous_) {
            hold_.sample(sampled_a_, sampled_b_, cycle.seconds());
        }
    }
    void step() noexcept {
        Vector next, pushed;
        multiply(next, sampled_a_, state_);
        multiply(pushed, sampled_b_, input_);
        next += pushed;
        if (finite(next)) {
            state_ = next;
        } else {
            state_ = start_;
            restarts = restarts + 1;
        }
    }
};

}  // namespace

HAL_COMPONENT(StateSpace, "state_space", "A linear plant or filter in state-space form", R"(
    plant=continuous:  x' = A x + B u,         y = C x + D u
    plant=discrete:    x(k+1) = A x(k) + B u,  y = C x + D u, a step per cycle

Up to 12 states, inputs and outputs; their numbers follow from the matrices. `y` is the output at
the end of the period, with the current input. A continuous plant is discretised exactly for inputs
held for the period (K. Åström, B. Wittenmark, *Computer-Controlled Systems*, 2.3), in the first
cycle of a thread, which takes a few microseconds longer.

Matrices are load arguments, with a comma between numbers and a `;` between rows, or in a `file=`:

    # rig.matrices: a mass of 2 kg on a spring
    A =  0   1
        -50 -0.5
    B = 0
        0.5
    C = 1 0

A NaN or infinite input is replaced by the previous one. If the states of an unstable plant
overflow, they are reset to `x0`.

    loadrt state_space names=sled a=0,1;-50,-0.5 b=0;0.5 c=1,0
    addf sled.update servo
    net push  => sled.u-0
    net place <= sled.y-0
)")
