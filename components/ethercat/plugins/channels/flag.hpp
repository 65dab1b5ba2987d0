// SPDX-License-Identifier: MIT
#pragma once

#include "ethercat/plugins/channels/channel.hpp"

namespace hal::ethercat {

/// A bit of the process data as the bit NAME; it may be an output of the slave.
class Flag final : public Channel {
public:
    explicit Flag(const ChannelPlan& plan)
        : field_(plan.field("val")),
          pin_(plan.component, plan.reads, plan.pin("").c_str(), "bit of the slave") {}

    void read(const SlaveImage& image) noexcept override { pin_ = field_.read_bit(image); }

private:
    ImageField field_;
    Out<bool> pin_;
};

}  // namespace hal::ethercat
