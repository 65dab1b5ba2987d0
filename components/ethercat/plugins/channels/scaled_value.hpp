// SPDX-License-Identifier: MIT
#pragma once

#include "ethercat/plugins/channels/channel.hpp"

namespace hal::ethercat {

/// A number of the slave as a float NAME: raw * factor. With the setting `unsigned` it has no sign.
class ScaledValue final : public Channel {
public:
    explicit ScaledValue(const ChannelPlan& plan)
        : field_(plan.field("val")),
          factor_(plan.channel.setting("factor", 1.0)),
          is_unsigned_(plan.channel.setting("unsigned", 0) != 0),
          pin_(plan.component, plan.reads, plan.pin("").c_str(), "scaled value") {}

    void read(const SlaveImage& image) noexcept override {
        if (!image.operational) return;
        const double raw = is_unsigned_ ? static_cast<double>(field_.read(image))
                                        : static_cast<double>(field_.read_signed(image));
        pin_ = raw * factor_;
    }

private:
    ImageField field_;
    const double factor_;
    const bool is_unsigned_;
    Out<double> pin_;
};

}  // namespace hal::ethercat
