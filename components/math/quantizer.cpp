// SPDX-License-Identifier: MIT
#include "hal/component.hpp"
#include "hal/limit.hpp"
#include "hal/retained.hpp"

namespace {

enum Mode : std::uint32_t { nearest = 0, down = 1, up = 2, towards_zero = 3 };

struct Quantizer : hal::Component {
    using Component::Component;
    hal::In<double> in{*this, "in", "value"};
    hal::In<double> step{
        *this, "step", "distance between two levels; 0 copies in to out", {.initial = 1.0}};
    hal::In<double> offset{*this, "offset", "value of level 0"};
    hal::In<std::uint32_t> mode{*this, "mode",
                                "rounding: 0 nearest; 1 down; 2 up; 3 towards level 0"};
    hal::In<double> hysteresis{
        *this, "hysteresis",
        "distance, in steps, by which in must pass the border of a level to leave it"};
    hal::Limit min{*this, "min-level", "lowest level", {.initial = -max_exact}};
    hal::Limit max{*this, "max-level", "highest level", {.initial = max_exact}};
    hal::Out<double> out{*this, "out", "level * step + offset", {.finite = true}};
    hal::Out<double> error{*this, "error", "in - out", {.finite = true}};
    hal::Out<std::int64_t> level{*this, "level", "number of the level"};
    hal::Out<bool> limited{*this, "limited",
                           "TRUE: in is below the lowest or above the highest level"};
    hal::Function run{*this, "", hal::step<&Quantizer::update>, "rounds in to a level"};

    void update(hal::Cycle) noexcept {
        if (std::isfinite(in)) {
            in_ = in;
        }
        const double origin = std::isfinite(offset) ? offset.get() : 0.0;
        const double height = std::fabs(step);
        const double exact = (in_ - origin) / height;
        // finer than any level
        if (!(height > 0.0) || !std::isfinite(height) || !(std::fabs(exact) <= max_exact)) {
            show(in_, 0.0, false);
            return;
        }
        double wanted = rounded(exact);
        // Between two adjacent levels, change only once in is beyond the border by the hysteresis.
        if (hysteresis > 0.0 && known_ && std::fabs(level_) <= max_exact) {
            const double band = std::min(hysteresis.get(), 1e6);
            const double low = rounded(exact - band);

            const double high = rounded(exact + band);
            if (low > level_) {
                wanted = low;
            } else if (high < level_) {
                wanted = high;
            } else {
                wanted = level_;
            }
        }
        const double low =
            std::isfinite(min) ? std::clamp(std::ceil(min), -max_exact, max_exact) : -max_exact;
        const double high =
            std::isfinite(max) ? std::clamp(std::floor(max), -max_exact, max_exact) : max_exact;
        level_ = std::min(std::max(wanted, low), high);
        known_ = true;
        show(level_ * height + origin, level_, level_ != wanted);
    }

private:
    // 2^53: whole numbers are exact up to here
    static constexpr double max_exact = 9007199254740992.0;
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
    double in_ = 0.0;
    double level_ = 0.0;
    bool known_ = false;
    hal::Retained retained_{*this, {{"in", in_}, {"level", level_}, {"known", known_}}};
};

}  // namespace

HAL_COMPONENT(Quantizer, "quantizer",
              "Rounds a value to discrete levels, as an A/D converter or an encoder does", R"(
    level = (in - offset) / step, rounded by mode and limited to min-level and max-level
    out   = level * step + offset
    error = in - out

Mode 0 rounds halves away from 0. With `hysteresis` h the level changes only when `in` is beyond its
border by h steps, so that noise does not cause chatter. A 12-bit converter for ±10 V has step
20/4096, min-level -2048, max-level 2047 (B. Widrow, I. Kollar, *Quantization Noise*, Cambridge
2008). For values distributed uniformly within a step, the standard deviation of the error is step /
sqrt(12).

While `in` is NaN or infinite its last valid value applies. With `step` 0, infinite or NaN, or above
2^53 levels, `out` is `in` and `level` is 0. The sign of `step` has no effect. A mode above 3 is
mode 0. If `min-level` is above `max-level`, `max-level` applies.

    loadrt quantizer names=adc
    addf adc servo
    setp adc.step 0.0048828125
    setp adc.min-level -2048
    setp adc.max-level 2047
    net tacho-volts  => adc.in
    net tacho-as-read <= adc.out
)")
