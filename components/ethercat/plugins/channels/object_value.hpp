// SPDX-License-Identifier: MIT
#pragma once

#include <bit>
#include <optional>

#include "ethercat/plugins/channels/object_request.hpp"

namespace hal::ethercat {

/// An object that is read once by SDO, as the output NAME: u32, or with the setting `real` a float.
class ObjectValue final : public Channel {
public:
    explicit ObjectValue(const ChannelPlan& plan) : object_(plan) {
        constexpr const char* about = "read by SDO at the start";
        if (plan.channel.setting("real", 0) != 0) {
            real_.emplace(plan.component, plan.reads, plan.pin("").c_str(), about);
        } else {
            number_.emplace(plan.component, plan.reads, plan.pin("").c_str(), about);
        }
    }

    void read(const SlaveImage& image) noexcept override {
        object_.step(image);
        if (!object_.known()) return;
        const auto raw = static_cast<std::uint32_t>(object_.value());
        if (real_) {
            *real_ = static_cast<double>(std::bit_cast<float>(raw));
        } else {
            *number_ = raw;
        }
    }
    void restart() noexcept override { object_.restart(); }

private:
    ObjectRequest object_;
    std::optional<Out<std::uint32_t>> number_;
    std::optional<Out<double>> real_;
};

}  // namespace hal::ethercat
