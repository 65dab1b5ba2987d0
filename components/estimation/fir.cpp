// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <vector>

#include "hal/component.hpp"
#include "hal/retained.hpp"

namespace {

struct Fir : hal::Component {
    explicit Fir(const hal_host* host)
        : Component(host),
          taps(*this, "taps", "", "coefficients, that of the newest sample first: 0.25,0.5,0.25"),
          length(*this, "length", 0, "without taps: number of coefficients of a low pass",
                 {.min = 0, .max = 1024}),
          corner(*this, "corner", 0.1,
                 "without taps: corner (gain 0.5) as a fraction of the thread's rate, below 0.5") {
        design();
        past_.assign(weights_.size(), 0.0);
        hal::Retained(
            *this, {{"past", past_}, {"newest", newest_}, {"last", last_}, {"started", started_}});
    }

    hal::TextArgument taps;
    hal::Argument length;
    hal::RealArgument corner;
    hal::In<double> in{*this, "in", "input"};
    hal::Out<double> out{*this, "out", "weighted sum of the last inputs", {.finite = true}};
    hal::In<bool> reset{*this, "reset", "TRUE fills the history with the current input"};
    hal::Out<std::uint32_t> bad_inputs{
        *this, "bad-inputs", "number of NaN or infinite inputs; the previous input is used"};
    hal::Function run{*this, "", &Fir::update, "filters"};

    void update(hal::Cycle) noexcept {
        const double now = in;
        if (!std::isfinite(now) || std::fabs(now) > 1e150) {
            bad_inputs = bad_inputs + 1;
        } else {
            last_ = now;
        }
        if (!started_ || reset) {
            for (double& x : past_) {
                x = last_;
            }
            started_ = std::isfinite(now);
        }
        newest_ = newest_ + 1 == past_.size() ? 0 : newest_ + 1;
        past_[newest_] = last_;
        double sum = 0.0;
        std::size_t at = newest_;
        for (const double w : weights_) {
            sum += w * past_[at];
            at = at == 0 ? past_.size() - 1 : at - 1;
        }
        out = sum;
    }

private:
    void design() {
        if (!taps.get().empty()) {
            std::size_t at = 0;
            const std::string& text = taps.get();
            const auto wrong = [&text](const std::string& why) {
                return hal::ArgumentError("taps", "taps=" + text + ": " + why);
            };
            while (at <= text.size()) {
                const std::size_t end = std::min(text.find_first_of(",; ", at), text.size());
                const std::string word = text.substr(at, end - at);
                char* rest = nullptr;
                const double w = std::strtod(word.c_str(), &rest);
                if (word.empty() || *rest != '\0' || !(std::fabs(w) < 1e100)) {
                    throw wrong("'" + word + "' is not a number; write them as 0.25,0.5,0.25");
                }
                weights_.push_back(w);
                at = end + 1;
            }
            if (weights_.size() > 1024) throw wrong("more than 1024");
            return;
        }
        if (!(corner > 0.0 && corner < 0.5)) {
            throw hal::ArgumentError("corner",
                                     "corner= is not between 0 and 0.5; write it as a fraction of "
                                     "the thread's rate, 0.05 for 50 Hz in a thread of 1 ms");
        }
        const auto n =
            static_cast<std::size_t>(length > 0 ? static_cast<std::int64_t>(length) : 31);
        // the ideal low pass, cut off by Hamming's window, 1 at frequency 0 (A. Oppenheim, R.
        // Schafer, *Discrete-Time Signal Processing*, 7.2)
        double sum = 0.0;
        for (std::size_t i = 0; i < n; ++i) {
            const double t = static_cast<double>(i) - 0.5 * static_cast<double>(n - 1);

            const double pi = std::numbers::pi;
            const double ideal =
                t == 0.0 ? 2.0 * corner : std::sin(2.0 * pi * corner * t) / (pi * t);
            const double window = n > 1 ? 0.54 - 0.46 * std::cos(2.0 * pi * static_cast<double>(i) /
                                                                 static_cast<double>(n - 1))
                                        : 1.0;
            weights_.push_back(ideal * window);
            sum += weights_.back();
        }
        for (double& w : weights_) {
            w /= sum;
        }
    }

    std::vector<double> weights_, past_;
    std::size_t newest_ = 0;
    double last_ = 0.0;
    bool started_ = false;
};

}  // namespace

HAL_COMPONENT(Fir, "fir",
              "Filter with a finite impulse response: given coefficients, or a low pass", R"(
    out(k) = taps[0] in(k) + taps[1] in(k-1) + ...

Up to 1024 `taps`; or `length` and `corner` for a low pass with a Hamming window, whose delay is
(length - 1) / 2 cycles at every frequency. The history is filled with the first input, so the
output does not jump at the start. A NaN or infinite input is replaced by the previous one.

    loadrt fir names=smooth length=41 corner=0.05
    addf smooth servo
    net noisy => smooth.in
    net quiet <= smooth.out
)")
