// SPDX-License-Identifier: MIT
#pragma once

#include "ethercat/plugins/channels/channel.hpp"

namespace hal::ethercat {

/// A bit of the slave as NAME and, inverted, as NAME-not.
class DigitalInput final : public Channel {
public:
    explicit DigitalInput(const ChannelPlan& plan)
        : field_(plan.field("in")),
          in_(plan.component, plan.reads, plan.pin("").c_str(), "the input"),
          in_not_(plan.component, plan.reads, plan.pin("not").c_str(), "the input, inverted") {}

    void read(const SlaveImage& image) noexcept override {
        if (!image.operational) return;
        const bool value = field_.read_bit(image);
        in_ = value;
        in_not_ = !value;
    }

private:
    ImageField field_;
    Out<bool> in_, in_not_;
};

}  // namespace hal::ethercat
