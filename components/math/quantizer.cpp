// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

enum Mode : std::uint32_t { nearest = 0, down = 1, up = 2, towards_zero = 3 };

struct Quantizer : hal::Component {
    using Component::Component;
    hal::In<double>        in{*this, "in", "the value"};
    hal::In<double>        step{*this, "step", "between two levels; 0: passes in", {.initial = 1.0}};
    hal::In<double>        offset{*this, "offset", "where level 0 lies"};
    hal::In<std::uint32_t> mode{*this, "mode", "0 nearest level; 1 the one below; 2 the one above; 3 the one towards level 0"};
    hal::In<double>        hysteresis{*this, "hysteresis", "how far in has to be beyond the border of a level to leave it, in steps"};
    hal::In<double>        min{*this, "min-level", "lowest level", {.initial = -most}};
    hal::In<double>        max{*this, "max-level", "highest level", {.initial = most}};
    hal::Out<double>       out{*this, "out", "level * step + offset", {.finite = true}};
    hal::Out<double>       error{*this, "error", "in - out", {.finite = true}};
    hal::Out<std::int64_t> level{*this, "level", "the level"};
    hal::Out<bool>         limited{*this, "limited", "TRUE: in lies beyond the lowest or the highest level"};
    hal::Function          run{*this, "", hal::step<&Quantizer::update>, "rounds in to a level"};

    void update(hal::Cycle) noexcept {
        if (std::isfinite(in)) in_ = in;
        const double origin = std::isfinite(offset) ? offset.get() : 0.0, height = std::fabs(step);
        const double exact = (in_ - origin) / height;
        if (!(height > 0.0) || !std::isfinite(height) || !(std::fabs(exact) <= most)) {  // finer than any level
            show(in_, 0.0, false);
            return;
        }
        double wanted = rounded(exact);
        // Between the old level and the next it moves only once in is beyond the border by the hysteresis.
        if (hysteresis > 0.0 && known_ && std::fabs(level_) <= most) {
            const double band = std::min(hysteresis.get(), 1e6), low = rounded(exact - band), high = rounded(exact + band);
            wanted = low > level_ ? low : high < level_ ? high : level_;
        }
        const double low = std::isfinite(min) ? std::clamp(std::ceil(min), -most, most) : -most;
        const double high = std::isfinite(max) ? std::clamp(std::floor(max), -most, most) : most;
        level_ = std::min(std::max(wanted, low), high);
        known_ = true;
        show(level_ * height + origin, level_, level_ != wanted);
    }

private:
    static constexpr double most = 9007199254740992.0;  // 2^53: whole numbers are exact up to here
    double rounded(double exact) const noexcept {
        switch (mode) {
            case down: return std::floor(exact);
            case up: return std::ceil(exact);
            case towards_zero: return std::trunc(exact);
            default: return std::round(exact);
        }
    }
    void show(double value, double at, bool beyond) noexcept {
        out = std::isfinite(value) ? value : in_;
        const double left = in_ - out;
        error = std::isfinite(left) ? left : 0.0;
        level = static_cast<std::int64_t>(at);
        limited = beyond;
    }
    double in_ = 0.0, level_ = 0.0;
    bool known_ = false;
};

}  // namespace

HAL_COMPONENT(Quantizer, "quantizer", "Rounds a value to levels: a converter, an encoder, a detent", R"(
    level = rounding of (in - offset) / step by mode, kept between min-level and max-level
    out   = level * step + offset
    error = in - out

Halves are rounded away from 0 in mode 0. With `hysteresis` h a level is left only when `in` is beyond its border by h steps, so noise
does not make it chatter. A converter of 12 bits for +-10 V: step 20/4096, min-level -2048, max-level 2047 (B. Widrow, I. Kollar,
*Quantization Noise*, Cambridge 2008). With equal chances of all values in a step the error has a standard deviation of step / sqrt(12).

While `in` is not a number its last value counts. With `step` 0, infinite or not a number, or beyond 2^53 levels, `out` is `in` and
`level` is 0. Its sign does not matter. A mode above 3 is mode 0. When `min-level` is above `max-level`, `max-level` wins.

    loadrt quantizer names=adc
    addf adc servo
    setp adc.step 0.0048828125
    setp adc.min-level -2048
    setp adc.max-level 2047
    net tacho-volts  => adc.in
    net tacho-as-read <= adc.out
)")
