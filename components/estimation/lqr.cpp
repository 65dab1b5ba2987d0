// SPDX-License-Identifier: MIT
#include <algorithm>
#include <chrono>
#include <cmath>
#include <deque>
#include <new>
#include <thread>

#include "estimation/design/riccati.hpp"
#include "estimation/matrices.hpp"
#include "hal/background.hpp"
#include "hal/component.hpp"
#include "hal/journal.hpp"
#include "hal/limit.hpp"
#include "hal/queue.hpp"
#include "hal/retained.hpp"

namespace {

using namespace hal::estimation;

enum class Plant { continuous, discrete, sampled };

struct Problem {
    Plant plant = Plant::continuous;
    Dense a, b, q, r;
    double period = 0.001;

    std::optional<Riccati> solve() const {
        if (plant == Plant::continuous) return continuous_riccati(a, b, q, r);
        if (plant == Plant::discrete) return discrete_riccati(a, b, q, r);
        const Sampled s = sample(a, b, q, r, period);
        return discrete_riccati(s.a, s.b, s.q, s.r, s.n);
    }
};

Plant parse_plant(const std::string& text) {
    if (text == "continuous") return Plant::continuous;
    if (text == "discrete") return Plant::discrete;
    if (text == "sampled") return Plant::sampled;
    throw hal::ArgumentError("plant", "plant=" + text + " is not continuous, sampled or discrete");
}

void check_period(double period_s) {
    if (period_s > 0.0 && period_s <= 3600.0) return;
    throw hal::ArgumentError("period",
                             "period= is not between 0 and 3600 s; write the thread's "
                             "period in s, 0.001 for one of 1 ms");
}

/// Rejects weights without a stabilising solution: Q is positive semidefinite, R positive definite.
void check_weights(const Matrices& matrices, const Problem& problem) {
    if (!is_positive_semidefinite(problem.q)) {
        matrices.refuse("Q", "Q has a negative eigenvalue",
                        "start with diag and a number per state, 0 or above");
    }
    if (!is_positive_definite(problem.r)) {
        matrices.refuse("R", "R is not positive", "start with diag and 1 per input");
    }
}

/// Formats "0.5, strongest in state 1".
std::string mode_text(const Mode& mode) {
    return text(mode.value) + ", strongest in state " + std::to_string(mode.state);
}

/// Rejects a plant with an unstable mode that no input controls or no weight observes.
void check_stabilisable(const Matrices& matrices, const Problem& problem) {
    const Time time = problem.plant == Plant::discrete ? Time::discrete : Time::continuous;
    if (const auto mode = unreachable(problem.a, problem.b, time)) {
        matrices.refuse(
            "B", "the plant is uncontrollable: no input reaches its mode at " + mode_text(*mode),
            "that mode is unstable; look at row " + std::to_string(mode->state + 1) +
                " of A and B");
    }
    if (const auto mode = unseen(problem.a, problem.q, time)) {
        matrices.refuse("Q", "the cost does not observe the plant's mode at " + mode_text(*mode),
                        "give that state a weight in Q");
    }
}

/// Reads the matrices of a component, as load arguments or in a file. Throws for an invalid one.
/// [setup]
Problem read_problem(hal::Component& component, const std::string& plant, double period_s) {
    Problem problem;
    problem.plant = parse_plant(plant);
    check_period(period_s);
    problem.period = period_s;
    const Matrices matrices(
        component, {{"A", "0,1;0,0", "n x n: system matrix"},
                    {"B", "0;1", "n x m: input matrix"},
                    {"Q", "1,0;0,1", "n x n: cost of the states; symmetric, positive semidefinite"},
                    {"R", "1", "m x m: cost of the inputs; symmetric, positive definite"}});
    problem.a = matrices.square("A");
    const Eigen::Index states = problem.a.rows();
    problem.b = matrices.with_rows("B", states, "it has a row per state, as A has");
    const Eigen::Index inputs = problem.b.cols();
    problem.q = matrices.symmetric("Q", states, "it has a row and a column per state",
                                   "a cost matrix is symmetric");
    problem.r =
        matrices.symmetric("R", inputs, "it has a row and a column per input, as B has columns",
                           "a cost matrix is symmetric");
    check_weights(matrices, problem);
    check_stabilisable(matrices, problem);
    return problem;
}

/// The current weights, from the cycle to the helper thread, and the resulting gain.
struct Order {
    Vector q, r;
    std::int64_t period_ns = 0;
    std::uint32_t number = 0;
};
struct Delivery {
    Matrix gain;
    bool good = false;
    std::uint32_t number = 0;

    /// Exchanges a gain with the journal that is as large as `gain` is now. [realtime]
    void exchange() noexcept {
        hal::journaled(good);
        hal::journaled(number);
        if (good) {
            hal::journaled(gain.data(), static_cast<std::size_t>(gain.size()));
        }
    }
};

/// Solves the Riccati equation outside of the cycle. The cycle is the only writer of orders and the
/// only reader of deliveries.
class Designer {
public:
    explicit Designer(Problem problem) : problem_(std::move(problem)) {}
    void start() {  ///< [setup]
        const hal::JournaledSource journaled;
        background_.start();
    }
    void stop() noexcept { background_.stop(); }  ///< [setup]

    hal::Mailbox<Order> orders;
    hal::Mailbox<Delivery> deliveries;

private:
    // a cycle must not wake a thread, so this thread polls
    static constexpr auto look_every = std::chrono::milliseconds(2);

    void turn(bool may_wait) noexcept {
        bool fresh = false;
        const Order& order = orders.get(&fresh);
        if (fresh) {
            deliveries.put(designed(order));
        } else if (may_wait) {
            std::this_thread::sleep_for(look_every);
        }
    }
    Delivery designed(const Order& order) const noexcept {
        Delivery delivery;
        delivery.number = order.number;
        if (!finite(order.q) || !finite(order.r)) return delivery;
        try {
            Problem problem = problem_;
            problem.q.diagonal() = order.q;
            problem.r.diagonal() = order.r;
            problem.period = static_cast<double>(order.period_ns) * 1e-9;
            if (!is_positive_semidefinite(problem.q)) return delivery;
            if (!is_positive_definite(problem.r)) return delivery;
            if (const auto solved = problem.solve()) {
                delivery.gain = solved->gain;
                delivery.good = finite(delivery.gain);
            }
        } catch (const std::bad_alloc&) {
            delivery.good = false;
        }
        return delivery;
    }
    const Problem problem_;
    hal::Background background_{[this](std::int64_t, bool may_wait) { turn(may_wait); }};
};

class Lqr : public hal::Component {
public:
    explicit Lqr(const hal_host* host)
        : Component(host),
          plant_(*this, "plant", "continuous",
                 "continuous: x' = Ax + Bu, gain of a continuous controller; sampled: the same "
                 "plant, gain for a u held for a "
                 "period; discrete: x(k+1) = Ax + Bu"),
          period_(*this, "period", 0.001,
                  "sampled: the thread's period in s, so that the gain is available in the first "
                  "cycle"),
          problem_(read_problem(*this, plant_.get(), period_)),
          x(*this, "x-#", problem_.a.rows(), "state #"),
          target(*this, "target-#", problem_.a.rows(), "target of state #"),
          u(*this, "u-#", problem_.b.cols(), "command for input #", {.safe = 0.0, .finite = true}),
          designer_(problem_) {
        for (Eigen::Index i = 0; i < problem_.a.rows(); ++i) {
            q_.emplace_back(
                *this, name("q", i).c_str(),
                ("weight of state " + std::to_string(i) + " squared; a change starts a new design")
                    .c_str(),
                hal::PinOptions<double>{.initial = problem_.q(i, i)});
        }
        for (Eigen::Index i = 0; i < problem_.b.cols(); ++i) {
            r_.emplace_back(
                *this, name("r", i).c_str(),
                ("weight of input " + std::to_string(i) + " squared; a change starts a new design")
                    .c_str(),
                hal::PinOptions<double>{.initial = problem_.r(i, i)});
        }
        const auto solved = problem_.solve();
        if (!solved) {
            throw std::runtime_error(
                "no gain was found for these matrices; the plant is controllable, but the numbers "
                "are out of range");
        }
        gain_ = solved->gain;
        order_.q = problem_.q.diagonal();
        order_.r = problem_.r.diagonal();
        order_.period_ns = std::llround(problem_.period * 1e9);
        state_ = Vector::Zero(problem_.a.rows());
        hal::Retained(*this, {{"gain", gain_}, {"state", state_}, {"blind", blind_}});
        for (Eigen::Index i = 0; i < gain_.rows(); ++i) {
            for (Eigen::Index j = 0; j < gain_.cols(); ++j) {
                gains_.emplace_back(*this, (name("gain", i) + "-" + std::to_string(j)).c_str(),
                                    ("effect of state " + std::to_string(j) + " on input " +
                                     std::to_string(i) + ": u = -gain (x - target)")
                                        .c_str(),
                                    hal::PinOptions<double>{.initial = gain_(i, j)});
            }
        }
        show();
    }

    void start() { designer_.start(); }
    void stop() noexcept { designer_.stop(); }

    void update(hal::Cycle cycle) noexcept {
        order(cycle);
        take_delivery();
        bool numbers = true;
        for (std::size_t i = 0; i < x.size(); ++i) {
            const double off = x[i] - target[i];
            if (std::isfinite(off)) {
                state_(static_cast<Eigen::Index>(i)) = off;
            } else {
                bad_inputs = bad_inputs + 1;
                numbers = false;
            }
        }
        blind_ = numbers ? 0 : std::min(blind_, UINT32_MAX - 1) + 1;
        valid = blind_ <= hold_cycles;
        Vector out;
        multiply(out, gain_, state_);
        bool full = false;
        for (std::size_t i = 0; i < u.size(); ++i) {
            const double wanted = -out(static_cast<Eigen::Index>(i));
            const double limit = std::fabs(max_output);
            const double given = limit > 0.0 ? std::clamp(wanted, -limit, limit) : wanted;
            full = full || given != wanted;
            u[i] = enable && valid && std::isfinite(given) ? given : 0.0;
        }
        saturated = full;
    }

private:
    static std::string name(const char* what, Eigen::Index i) {
        return std::string(what) + "-" + std::to_string(i);
    }

    void take_delivery() noexcept {
        bool fresh = false;
        const Delivery& newest = designer_.deliveries.get(&fresh);
        hal::journaled(fresh);
        if (!fresh) return;
        delivery_ = newest;
        if (delivery_.gain.size() != gain_.size()) {
            delivery_.gain = gain_;  // executed again: the recorded one follows
        }
        delivery_.exchange();
        rejected = !delivery_.good;
        designing = delivery_.number != order_.number;
        if (!delivery_.good) return;
        gain_ = delivery_.gain;
        designs = designs + 1;
        show();
    }
    void order(hal::Cycle cycle) noexcept {
        bool changed = problem_.plant == Plant::sampled && cycle.period_ns() != order_.period_ns;
        for (std::size_t i = 0; i < q_.size(); ++i) {
            changed = take(order_.q(static_cast<Eigen::Index>(i)), q_[i]) || changed;
        }
        for (std::size_t i = 0; i < r_.size(); ++i) {
            changed = take(order_.r(static_cast<Eigen::Index>(i)), r_[i]) || changed;
        }
        if (!changed) return;
        order_.period_ns = cycle.period_ns();
        ++order_.number;
        designer_.orders.put(order_);
        designing = true;
    }
    /// True if the values differ; NaN equals NaN.
    static bool take(double& last, double now) noexcept {
        const bool other = std::isnan(now) ? !std::isnan(last) : last != now;
        last = now;
        return other;
    }
    void show() noexcept {
        for (Eigen::Index i = 0, k = 0; i < gain_.rows(); ++i) {
            for (Eigen::Index j = 0; j < gain_.cols(); ++j, ++k) {
                gains_[static_cast<std::size_t>(k)] = gain_(i, j);
            }
        }
    }

    hal::TextArgument plant_;
    hal::RealArgument period_;
    Problem problem_;

public:
    hal::Ins<double> x, target;
    hal::Outs<double> u;
    hal::In<bool> enable{*this, "enable", "FALSE sets all u to 0", {.initial = true}};
    hal::OptionalLimit max_output{*this, "max-output", "limit of each u; 0: no limit"};
    hal::Out<bool> saturated{*this, "saturated", "TRUE: a u is at its limit"};
    hal::Out<bool> designing{*this, "designing",
                             "TRUE: a new gain is being computed; the old one is in use"};
    hal::Out<bool> rejected{
        *this, "rejected",
        "TRUE: the weights are invalid (negative or NaN); the last valid gain is in use"};
    hal::Out<std::uint32_t> designs{*this, "designs", "number of gains applied since the start"};
    hal::Out<bool> valid{
        *this,
        "valid",
        "FALSE: a state was NaN or infinite for longer than hold-cycles; all u are 0",
        {.safe = false}};
    hal::Out<std::uint32_t> bad_inputs{*this, "bad-inputs",
                                       "number of states that were NaN or infinite"};
    hal::Param<std::uint32_t> hold_cycles{*this,
                                          "hold-cycles",
                                          "number of consecutive cycles for which the last valid "
                                          "value replaces a NaN or infinite state",
                                          {.initial = 10}};
    hal::Function run{*this, "update", &Lqr::update, "applies the gain, after taking a new one"};

private:
    std::deque<hal::In<double>> q_, r_;
    std::deque<hal::Out<double>> gains_;
    Matrix gain_;
    Vector state_;
    Order order_;
    Delivery delivery_;  // of this cycle
    std::uint32_t blind_ = 0;  // consecutive cycles with a NaN or infinite state
    Designer designer_;
};

}  // namespace

HAL_COMPONENT(Lqr, "lqr", "Linear-quadratic regulator, designed from plant and weights", R"(
    u = -K (x - target),  K minimises the sum of x'Qx + u'Ru for
    plant=continuous   x' = Ax + Bu
    plant=sampled      x' = Ax + Bu with u held over a period; the cost is integrated, not summed (C. Van Loan, 1978)
    plant=discrete     x(k+1) = Ax + Bu

`sampled` matches a thread: the gain is for its period, and is computed again if the thread has a
period other than `period=`. Matrices are load arguments, a comma between numbers and a `;` between
rows, or stand in a `file=` (see state_space). Riccati's equation is solved by structure-preserving
doubling (E. Chu, H. Fan, W. Lin, 2004 and 2005) when the component is loaded, and later in a thread
of its own: a change of the weights `q-N` or `r-N` (the diagonals of Q and R) starts it, and the
cycle swaps the gain in when it is done. Under `hal sim` that is the next cycle, so that each run
comes out the same.

A plant with an unstable mode that is not controllable, or that Q does not observe, is rejected; the
error names the mode. A NaN or infinite state is replaced by its last valid value for `hold-cycles`;
then `valid` becomes FALSE and all u are 0 until it is valid again. Link `gain-I-J` to a component
with its own control law, such as furuta_control.

    loadrt lqr names=sled plant=sampled a=0,1;0,0 b=0;0.5 q=100,0;0,1 r=0.01
    addf sled.update servo
    setp sled.max-output 40
    net place => sled.x-0
    net speed => sled.x-1
    net force <= sled.u-0
)")
