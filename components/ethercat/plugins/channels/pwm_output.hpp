// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>

#include "ethercat/plugins/channels/channel.hpp"

namespace hal::ethercat {

/// A pulse width of a LED terminal, as the EL2564. The name of the channel is its number:
///
///     percent = clamp(pwm-N * scale-N + offset-N, 0, 100)       val = percent / 100 * 65535
///
/// 0 while enable-N is FALSE.
class PwmOutput final : public Channel {
public:
    explicit PwmOutput(const ChannelPlan& plan)
        : field_(plan.field("val")),
          value_(plan.component, plan.writes, plan.numbered_pin("pwm").c_str(), "requested value"),
          enable_(plan.component, plan.writes, plan.numbered_pin("enable").c_str(),
                  "FALSE: output 0"),
          scale_(plan.component, plan.writes, plan.numbered_pin("scale").c_str(),
                 "percent of one unit of the value", {.initial = 0.5}),
          offset_(plan.component, plan.writes, plan.numbered_pin("offset").c_str(),
                  "is added to the percentage", {.unit = "%"}) {}

    void write(const SlaveImage& image) noexcept override {
        if (!enable_) {
            field_.write(image, 0);
            return;
        }
        const double percent = value_ * scale_ + offset_;
        if (!std::isfinite(percent)) return;  // the last value stays
        const double share = std::clamp(percent, 0.0, 100.0) / 100.0;
        field_.write(image, static_cast<std::uint64_t>(share * full_scale));
    }

private:
    static constexpr double full_scale = 65535.0;

    ImageField field_;
    In<double> value_;
    In<bool> enable_;
    Param<double> scale_, offset_;
};

}  // namespace hal::ethercat
