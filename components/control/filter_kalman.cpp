// SPDX-License-Identifier: MIT
#include "hal/component.hpp"
#include "hal/retained.hpp"

namespace {

// The Kalman filter of one value, measured with the variance Rk, whose true value changes with the
// variance Qk per cycle:
//     p = p + Qk,  k = p / (p + Rk),  x = x + k (z - x),  p = (1 - k) p
struct FilterKalman : hal::Component {
    using Component::Component;
    static constexpr double tiny = 1.17549e-38;
    hal::In<bool> debug{*this, "debug", "no effect; record zk and xk-out instead"};
    hal::In<bool> passthrough{*this, "passthrough", "TRUE copies zk to xk-out"};
    hal::In<bool> reset{*this, "reset", "TRUE restarts the filter and sets xk-out to 0"};
    hal::In<double> zk{*this, "zk", "measured value"};
    hal::Out<double> xk_out{*this, "xk-out", "estimated value"};
    hal::Param<double> rk{*this, "Rk", "variance of the measurement", {.initial = tiny}};
    hal::Param<double> qk{*this,
                          "Qk",
                          "variance of the true value's change per cycle (process noise)",
                          {.initial = tiny}};
    hal::Function run{*this, "", &FilterKalman::update, "estimates"};

    void update(hal::Cycle) noexcept {
        if (reset) {
            x_ = 0.0;
            p_ = 1.0;
        } else if (passthrough) {
            xk_out = zk.get();
            return;
        } else {
            estimate(zk);
        }
        xk_out = x_;
    }

private:
    void estimate(double z) noexcept {
        // NaN counts as 0
        const double before = p_ + std::fmax(qk, 0.0);
        const double noise = std::fmax(rk, 0.0);
        const double gain = before + noise > 0.0 ? before / (before + noise) : 1.0;
        const double x = x_ + gain * (z - x_);
        const double p = (1.0 - gain) * before;
        if (!std::isfinite(x) || !std::isfinite(p)) return;
        x_ = x;
        p_ = p;
    }

    double x_ = 0.0;
    double p_ = 1.0;
    hal::Retained retained_{*this, {{"x", x_}, {"p", p_}}};
};

}  // namespace

HAL_COMPONENT(FilterKalman, "filter_kalman", "Kalman filter of one value", R"(
Estimates a value from noisy measurements. `Rk` is the variance of the sensor: record it at rest and
compute the variance of the samples. `Qk` is the variance of the true value's change per cycle: a
smaller value gives a smoother and slower estimate. Only their ratio matters once the filter has
settled. Set both; the defaults fit no real sensor. Negative values count as 0 (LinuxCNC: the
estimate diverges). Measurements that are NaN or infinite are ignored.

    loadrt filter_kalman names=coolant-filter
    addf coolant-filter servo
    setp coolant-filter.Rk 0.25
    setp coolant-filter.Qk 0.001
    net coolant-raw         => coolant-filter.zk
    net coolant-temperature <= coolant-filter.xk-out
)")
