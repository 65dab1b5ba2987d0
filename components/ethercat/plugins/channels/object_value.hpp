// SPDX-License-Identifier: MIT
#pragma once

#include "ethercat/plugins/channels/object_request.hpp"

namespace hal::ethercat {

/// An object that is read once by SDO, as the output NAME.
class ObjectValue final : public Channel {
public:
    explicit ObjectValue(const ChannelPlan& plan)
        : object_(static_cast<std::uint16_t>(plan.channel.setting("index", 0)),
                  static_cast<std::uint8_t>(plan.channel.setting("sub", 0)),
                  static_cast<unsigned>(plan.channel.setting("bits", 32)), false),
          pin_(plan.component, plan.reads, plan.pin("").c_str(), "read by SDO at the start") {}

    void read(const SlaveImage& image) noexcept override {
        object_.step(image);
        if (object_.known()) {
            pin_ = static_cast<std::uint32_t>(object_.value());
        }
    }
    void restart() noexcept override { object_.restart(); }

private:
    ObjectRequest object_;
    Out<std::uint32_t> pin_;
};

}  // namespace hal::ethercat
