// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <optional>

#include "ethercat/plugins/channels/channel.hpp"

namespace hal::ethercat {

/// An analog output, or with the setting `motor` the speed of a motor terminal:
///
///     duty = clamp(value / scale + offset, min-dc, max-dc)       raw = duty * 32767
///
/// 0 while `enable` is FALSE. A motor has the pins -cmd and -raw-cmd instead of -value and -raw.
class AnalogOutput final : public Channel {
public:
    explicit AnalogOutput(const ChannelPlan& plan)
        : motor_(plan.channel.setting("motor", 0) != 0),
          field_(plan.field("val")),
          enable_field_(plan.field("enable")),
          scale_(plan.component, plan.writes, plan.pin("scale").c_str(), "value at full scale",
                 {.initial = 1.0}),
          offset_(plan.component, plan.writes, plan.pin("offset").c_str(),
                  "is added to the duty cycle"),
          min_(plan.component, plan.writes, plan.pin("min-dc").c_str(), "smallest duty cycle",
               {.initial = -1.0}),
          max_(plan.component, plan.writes, plan.pin("max-dc").c_str(), "largest duty cycle",
               {.initial = 1.0}),
          duty_(plan.component, plan.writes, plan.pin("curr-dc").c_str(), "duty cycle, -1..1"),
          enable_(plan.component, plan.writes, plan.pin("enable").c_str(), "FALSE: output 0"),
          absolute_(plan.component, plan.writes, plan.pin("absmode").c_str(),
                    "takes the absolute value"),
          value_(plan.component, plan.writes, plan.pin(motor_ ? "cmd" : "value").c_str(),
                 "requested value"),
          raw_(plan.component, plan.writes, plan.pin(motor_ ? "raw-cmd" : "raw").c_str(),
               "value for the slave") {
        if (!motor_) {
            positive_.emplace(plan.component, plan.writes, plan.pin("pos").c_str(),
                              "the value is above 0");
            negative_.emplace(plan.component, plan.writes, plan.pin("neg").c_str(),
                              "the value is below 0");
        }
    }

    void write(const SlaveImage& image) noexcept override {
        limit_range();
        const bool enabled = enable_;
        const double value = value_;
        enable_field_.write(image, enabled ? 1 : 0);
        if (positive_) {
            *positive_ = enabled && value > 0;
            *negative_ = enabled && value < 0;
        }
        if (!enabled) {
            duty_ = 0.0;
            raw_ = static_cast<std::int32_t>(field_.write_limited(image, 0.0));
            return;
        }
        const double magnitude = absolute_ ? std::fabs(value) : value;
        const double duty = magnitude / scale_.get() + offset_.get();
        if (!std::isfinite(duty)) return;  // the last value stays
        const double limited = std::min(std::max(duty, min_.get()), max_.get());
        duty_ = limited;
        raw_ = static_cast<std::int32_t>(field_.write_limited(image, limited * full_scale));
    }

private:
    static constexpr double full_scale = 32767.0;

    /// Corrects the pins of the range: -1 <= min-dc <= max-dc <= 1, and a scale other than 0.
    void limit_range() noexcept {
        if (max_ > 1.0) {
            max_ = 1.0;
        }
        if (min_ > max_) {
            min_ = max_.get();
        }
        if (min_ < -1.0) {
            min_ = -1.0;
        }
        if (max_ < min_) {
            max_ = min_.get();
        }
        if (const double scale = usable_scale(scale_); scale != scale_.get()) {
            scale_ = scale;
        }
    }

    const bool motor_;
    ImageField field_, enable_field_;
    Io<double> scale_, offset_, min_, max_;
    Out<double> duty_;
    In<bool> enable_, absolute_;
    In<double> value_;
    Out<std::int32_t> raw_;
    std::optional<Out<bool>> positive_, negative_;
};

}  // namespace hal::ethercat
