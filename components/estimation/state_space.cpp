// SPDX-License-Identifier: MIT
#include <cmath>

#include "estimation/design/plant.hpp"
#include "estimation/hold.hpp"
#include "estimation/matrices.hpp"
#include "hal/component.hpp"

namespace {

using namespace hal::estimation;

struct StateSpace : hal::Component {
    explicit StateSpace(const hal_host* host)
        : Component(host),
          plant(*this, "plant", "continuous", "continuous: x' = Ax + Bu; discrete: x(k+1) = Ax + Bu, a step per cycle"),
          model_(read()),
          u(*this, "u-#", model_.b.cols(), "input #"),
          y(*this, "y-#", model_.c.rows(), "output #: row # of Cx + Du", {.finite = true}),
          x(*this, "x-#", model_.a.rows(), "state #", {.finite = true}) {
        for (std::size_t i = 0; i < x.size(); ++i) x[i] = state_(static_cast<Eigen::Index>(i));
    }

    hal::TextArgument plant;

private:
    struct Model {
        Matrix a, b, c, d;
    };
    bool                  continuous_ = true;  // before the model: reading that sets these
    Vector                start_, state_, input_;
    Model                 model_;
    Matrix                sampled_a_, sampled_b_;
    hal::estimation::Hold hold_;
    std::int64_t          period_ns_ = 0;

public:
    hal::Ins<double>        u;
    hal::Outs<double>       y, x;
    hal::In<bool>           reset{*this, "reset", "while TRUE the states are those of x0"};
    hal::Out<std::uint32_t> bad_inputs{*this, "bad-inputs", "inputs that were no number: the one of the cycle before was taken"};
    hal::Out<std::uint32_t> restarts{*this, "restarts", "times the states grew beyond all numbers and went back to x0"};
    hal::Function           run{*this, "update", &StateSpace::update, "moves the plant on by one period and gives its outputs"};

    void update(hal::Cycle cycle) noexcept {
        if (cycle.period_ns() != period_ns_) sample(cycle);
        for (std::size_t i = 0; i < u.size(); ++i) {
            const double value = u[i];
            if (std::isfinite(value)) input_(static_cast<Eigen::Index>(i)) = value;
            else bad_inputs = bad_inputs + 1;
        }
        if (reset) state_ = start_;
        else step();
        Vector out, through;
        multiply(out, model_.c, state_);
        multiply(through, model_.d, input_);
        out += through;
        if (!finite(out)) out.setZero();
        for (std::size_t i = 0; i < y.size(); ++i) y[i] = out(static_cast<Eigen::Index>(i));
        for (std::size_t i = 0; i < x.size(); ++i) x[i] = state_(static_cast<Eigen::Index>(i));
    }

private:
    Model read() {
        const bool continuous = plant.get() == "continuous";
        if (!continuous && plant.get() != "discrete")
            throw hal::ArgumentError("plant", "plant=" + plant.get() + " is neither continuous nor discrete");
        continuous_ = continuous;
        const Matrices given(*this, {{"A", "0,1;-1,-1", "n x n: how the states drive each other"},
                                     {"B", "0;1", "n x m: how the inputs drive the states"},
                                     {"C", "1,0", "p x n: how the states show in the outputs; without it the outputs are the states"},
                                     {"D", "", "p x m: how the inputs show in the outputs at once; 0 without it"},
                                     {"x0", "", "n: the states at the start; 0 without it"}});
        Model          model;
        model.a = given.square("A");
        const auto n = model.a.rows();
        model.b = given.at("B", n, given.at("B").value.cols(), "it has a row per state, as A has");
        model.c = given.has("C") ? given.at("C", given.at("C").value.rows(), n, "it has a column per state") : Dense(Dense::Identity(n, n));
        model.d = Matrix::Zero(model.c.rows(), model.b.cols());
        if (given.has("D")) model.d = given.at("D", model.c.rows(), model.b.cols(), "it has a row per output and a column per input");
        start_ = Vector::Zero(n);
        if (given.has("x0")) start_ = given.vector("x0", n, "it has a number per state");
        state_ = start_;
        input_ = Vector::Zero(model.b.cols());
        return model;
    }
    void sample(hal::Cycle cycle) noexcept {
        period_ns_ = cycle.period_ns();
        sampled_a_ = model_.a, sampled_b_ = model_.b;
        if (continuous_) hold_.sample(sampled_a_, sampled_b_, cycle.seconds());
    }
    void step() noexcept {
        Vector next, pushed;
        multiply(next, sampled_a_, state_);
        multiply(pushed, sampled_b_, input_);
        next += pushed;
        if (finite(next)) state_ = next;
        else {
            state_ = start_;
            restarts = restarts + 1;
        }
    }
};

}  // namespace

HAL_COMPONENT(StateSpace, "state_space", "A linear plant or filter in state-space form", R"(
    plant=continuous:  x' = A x + B u,         y = C x + D u
    plant=discrete:    x(k+1) = A x(k) + B u,  y = C x + D u, a step per cycle

Up to 12 states, inputs and outputs; how many there are follows from the matrices. `y` is that of the end of the period, with
the input of now. A continuous plant is solved exactly for inputs that are held over the period (K. Åström, B. Wittenmark,
*Computer-Controlled Systems*, 2.3), in the first cycle of a thread: that one takes some microseconds longer.

Matrices are load arguments, a comma between numbers and a `;` between rows, or stand in a `file=`:

    # rig.matrices: a mass of 2 kg on a spring
    A =  0   1
        -50 -0.5
    B = 0
        0.5
    C = 1 0

An input that is no number is left out: the one of the cycle before stays. An unstable plant whose states grow beyond all
numbers starts again at `x0`.

    loadrt state_space names=sled a=0,1;-50,-0.5 b=0;0.5 c=1,0
    addf sled.update servo
    net push  => sled.u-0
    net place <= sled.y-0
)")
