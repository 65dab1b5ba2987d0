// SPDX-License-Identifier: MIT
#include <cmath>
#include <deque>

#include "estimation/channels.hpp"
#include "estimation/model.hpp"
#include "estimation/past.hpp"
#include "hal/component.hpp"
#include "hal/retained.hpp"
#include "hal/texts.hpp"

namespace {

using namespace hal::estimation;

constexpr const char* example = R"(constant gl = 9.81 / 0.3
state angle = 0 sigma 0.5 noise 0
state speed = 0 sigma 1 noise 0.1
angle' = speed
speed' = -gl * sin(angle) - 0.1 * speed
measure encoder = angle sigma 0.002 wrap
)";

/// The model as the filter needs it: a step by Runge and Kutta on duals gives the state and its
/// derivative by the state before.
class Nonlinear {
public:
    explicit Nonlinear(Model model) : model_(std::move(model)), values_(model_.variables()) {
        for (std::size_t i = 0; i < model_.constants.size(); ++i) {
            values_[max_slopes + Model::max_inputs + i].value = model_.constants[i];
        }
    }
    const Model& model() const noexcept { return model_; }
    void set_period(double period) noexcept { period_ = period; }

    void predict(Moment& to, const Moment& from) noexcept {
        const std::size_t n = model_.states.size();
        for (std::size_t i = 0; i < model_.inputs.size(); ++i) {
            values_[max_slopes + i] = Dual{to.u(static_cast<Eigen::Index>(i))};
        }
        States x{};
        States k1{};
        States k2{};
        States k3{};
        States k4{};
        States next{};
        for (std::size_t i = 0; i < n; ++i) {
            x[i].value = from.x(static_cast<Eigen::Index>(i));
            x[i].slope[i] = 1.0;
        }
        rates(x, k1);
        rates(along(x, k1, 0.5 * period_), k2);
        rates(along(x, k2, 0.5 * period_), k3);
        rates(along(x, k3, period_), k4);
        for (std::size_t i = 0; i < n; ++i) {
            const auto step = [&](double a, double b, double c, double d) {
                return period_ / 6.0 * (a + 2.0 * b + 2.0 * c + d);
            };
            next[i].value = x[i].value + step(k1[i].value, k2[i].value, k3[i].value, k4[i].value);
            for (std::size_t j = 0; j < n; ++j) {
                next[i].slope[j] = x[i].slope[j] + step(k1[i].slope[j], k2[i].slope[j],
                                                        k3[i].slope[j], k4[i].slope[j]);
            }
        }
        const auto size = static_cast<Eigen::Index>(n);
        f_.resize(size, size);
        q_.setZero(size, size);
        to.x.resize(size);
        for (Eigen::Index i = 0; i < size; ++i) {
            const auto at = static_cast<std::size_t>(i);
            to.x(i) = next[at].value;
            q_(i, i) = model_.states[at].noise * model_.states[at].noise * period_;
            for (Eigen::Index j = 0; j < size; ++j) {
                f_(i, j) = next[at].slope[static_cast<std::size_t>(j)];
            }
        }
        propagate_covariance(to.p, f_, from.p, q_);
    }
    Correction measure(Moment& moment, Eigen::Index channel, double gate) noexcept {
        const Model::Measure& m = model_.measures[static_cast<std::size_t>(channel)];
        const std::size_t n = model_.states.size();
        for (std::size_t i = 0; i < n; ++i) {
            values_[i] = Dual{moment.x(static_cast<Eigen::Index>(i))};
            values_[i].slope[i] = 1.0;
        }
        for (std::size_t i = 0; i < model_.inputs.size(); ++i) {
            values_[max_slopes + i] = Dual{moment.u(static_cast<Eigen::Index>(i))};
        }
        const Dual expected = m.value(values_.data(), n);
        double innovation = moment.z(channel) - expected.value;
        if (m.wrap > 0.0) {
            innovation = std::remainder(innovation, m.wrap);
        }
        Vector row(static_cast<Eigen::Index>(n));
        for (std::size_t i = 0; i < n; ++i) {
            row(static_cast<Eigen::Index>(i)) = expected.slope[i];
        }
        // a formula that has no value here
        if (!std::isfinite(innovation) || !finite(row)) return Correction::outlier;
        return correct(moment.x, moment.p, row, innovation, m.sigma * m.sigma, gate);
    }

private:
    using States = std::array<Dual, max_slopes>;

    void rates(const States& x, States& to) noexcept {
        const std::size_t n = model_.states.size();
        for (std::size_t i = 0; i < n; ++i) {
            values_[i] = x[i];
        }
        for (std::size_t i = 0; i < n; ++i) {
            to[i] = model_.states[i].rate(values_.data(), n);
        }
    }
    States along(const States& x, const States& k, double by) const noexcept {
        States to = x;
        for (std::size_t i = 0; i < model_.states.size(); ++i) {
            to[i].value += by * k[i].value;
            for (std::size_t j = 0; j < model_.states.size(); ++j) {
                to[i].slope[j] += by * k[i].slope[j];
            }
        }
        return to;
    }

    Model model_;
    std::vector<Dual> values_;
    Matrix f_, q_;
    double period_ = 0.001;
};

class Ekf : public hal::Component {
public:
    explicit Ekf(const hal_host* host)
        : Component(host),
          texts_(*this),
          file_(*this, "model", "",
                "model file, relative to the netlist; default: a pendulum of 0.3 m"),
          history_(
              *this, "history", 32,
              "length of the history in cycles; measurements may be up to history - 2 cycles old",
              {.min = 3, .max = 4096}),
          plant_(read()),
          past_(plant_, static_cast<std::size_t>(history_), start(), covariance(),
                count(plant_.model().inputs), count(plant_.model().measures)),
          channels_(*this, count(plant_.model().measures), names()) {
        for (const auto& name : plant_.model().inputs) {
            inputs_.emplace_back(*this, dashed(name).c_str(),
                                 "input of the model since the previous cycle");
        }
        for (const Model::State& s : plant_.model().states) {
            x_.emplace_back(*this, ("x-" + dashed(s.name)).c_str(),
                            ("state " + s.name + ", estimated").c_str(),
                            hal::PinOptions<double>{.finite = true});
            sigma_.emplace_back(*this, ("sigma-" + dashed(s.name)).c_str(),
                                ("standard deviation of state " + s.name).c_str(),
                                hal::PinOptions<double>{.finite = true});
        }
        input_ = Vector::Zero(count(plant_.model().inputs));
        hal::Retained(*this, {{"input", input_}});
        past_.retain(*this);
    }

    void update(hal::Cycle cycle) noexcept {
        plant_.set_period(cycle.seconds());
        if (reset) {
            past_.restart();
        }
        for (std::size_t i = 0; i < inputs_.size(); ++i) {
            if (const double value = inputs_[i]; std::isfinite(value)) {
                input_(static_cast<Eigen::Index>(i)) = value;
            }
        }
        past_.advance(input_);
        channels_.feed(past_, cycle);
        past_.settle(std::fmax(channels_.gate, 0.0));
        channels_.show_outcome(past_, cycle);
        const Moment& now = past_.now();
        for (std::size_t i = 0; i < x_.size(); ++i) {
            const auto at = static_cast<Eigen::Index>(i);
            x_[i] = now.x(at);
            sigma_[i] = std::sqrt(std::fmax(now.p(at, at), 0.0));
        }
    }

private:
    template <class List>
    static Eigen::Index count(const List& list) noexcept {
        return static_cast<Eigen::Index>(list.size());
    }
    static std::string dashed(std::string name) {
        for (char& c : name) {
            c = c == '_' ? '-' : static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
        }
        return name;
    }
    std::vector<std::string> names() const {
        std::vector<std::string> names;
        for (const auto& m : plant_.model().measures) {
            names.push_back(dashed(m.name));
        }
        return names;
    }
    Vector start() const {
        Vector x(count(plant_.model().states));
        for (Eigen::Index i = 0; i < x.size(); ++i) {
            x(i) = plant_.model().states[static_cast<std::size_t>(i)].start;
        }
        return x;
    }
    Matrix covariance() const {
        const Eigen::Index n = count(plant_.model().states);
        Matrix p = Matrix::Zero(n, n);
        for (Eigen::Index i = 0; i < n; ++i) {
            p(i, i) = std::pow(plant_.model().states[static_cast<std::size_t>(i)].sigma, 2);
        }
        return p;
    }
    Nonlinear read() const {
        const std::string text = file_.get().empty() ? example : texts_.read("model", file_.get());
        Model model;
        model.read(text);
        texts_.reject(file_.get(), text, "model-text", model.problems);
        return Nonlinear(std::move(model));
    }

    hal::Texts texts_;
    hal::TextArgument file_;
    hal::Argument history_;
    Nonlinear plant_;
    Past<Nonlinear> past_;
    Channels channels_;
    Vector input_;
    std::deque<hal::In<double>> inputs_;
    std::deque<hal::Out<double>> x_, sigma_;

public:
    hal::In<bool> reset{
        *this, "reset",
        "TRUE resets the estimate to its initial value, corrected by the current measurements"};
    hal::Function run{*this, "update", &Ekf::update,
                      "predicts one period and applies the measurements"};
};

}  // namespace

HAL_COMPONENT(Ekf, "ekf", "Extended Kalman filter of a plant given by formulas", R"(
The model is a file of lines:

    # pendulum.model
    constant l = 0.3
    input  torque
    state  angle = 0   sigma 0.5  noise 0       # start, its standard deviation, and what it wanders by in a second
    state  speed = 0   sigma 1    noise 0.1
    angle' = speed
    speed' = -9.81 / l * sin(angle) - 0.1 * speed + 40 * torque
    measure encoder = angle           sigma 0.002  wrap
    measure camera  = l * sin(angle)  sigma 0.005

At most 8 states, 8 inputs, 12 measurements. Formulas have + - * / ^, brackets, pi and sin cos tan
asin acos atan atan2 sqrt exp log abs tanh min max. `wrap` after a measurement declares an angle:
359 degrees are 1 degree from 0; `wrap 65536` declares a 16-bit counter. Pins are named as in the
file (with `-` for `_`): here `torque`, `encoder`, `encoder-age`, `encoder-new`, `camera` and so on,
and `x-angle`, `sigma-angle`, `x-speed`, `sigma-speed`.

A period is one Runge-Kutta step; the derivatives with respect to the states are exact (forward
differentiation). Late and invalid measurements are handled as in kalman: see its manual for age,
new, gate, timeout and the counters. If a formula has no value at the estimate (the root of a
negative number), its measurement counts as an outlier.

    loadrt ekf names=swing
    addf swing.update servo
    setp swing.encoder-age 0.003
    net angle => swing.encoder
    net speed <= swing.x-speed
)")
