// SPDX-License-Identifier: MIT
#pragma once

#include "ethercat/plugins/channels/channel.hpp"

namespace hal::ethercat {

/// The analog output for an inverter, as NAME-dac-value: 10 is full scale. The direction pins of
/// lcec exist and have no effect: the controller has no outputs for them.
class InverterVoltage final : public Channel {
public:
    explicit InverterVoltage(const ChannelPlan& plan)
        : field_(plan.field("val")),
          value_(plan.component, plan.writes, plan.pin("dac-value").c_str(), "requested voltage",
                 {.unit = "V"}),
          forward_(plan.component, plan.writes, plan.pin("forward").c_str(), "without effect"),
          reverse_(plan.component, plan.writes, plan.pin("reverse").c_str(), "without effect") {}

    void write(const SlaveImage& image) noexcept override {
        field_.write_limited(image, value_ / 10.0 * full_scale);
    }

private:
    static constexpr double full_scale = 32767.0;

    ImageField field_;
    In<double> value_;
    In<bool> forward_, reverse_;
};

}  // namespace hal::ethercat
