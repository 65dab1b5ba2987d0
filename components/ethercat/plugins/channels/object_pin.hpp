// SPDX-License-Identifier: MIT
#pragma once

#include <optional>

#include "ethercat/plugins/channels/object_request.hpp"

namespace hal::ethercat {

/// An object that is not in the process data, as the input NAME. It is written by SDO when the pin
/// has another value than the slave. A pin that is 0 and not linked keeps what the slave has.
class ObjectPin final : public Channel {
public:
    explicit ObjectPin(const ChannelPlan& plan)
        : object_(static_cast<std::uint16_t>(plan.channel.setting("index", 0)),
                  static_cast<std::uint8_t>(plan.channel.setting("sub", 0)),
                  static_cast<unsigned>(plan.channel.setting("bits", 32)),
                  plan.channel.setting("signed", 0) != 0) {
        constexpr const char* about = "written by SDO when it changes";
        if (plan.channel.setting("signed", 0) != 0) {
            signed_.emplace(plan.component, plan.writes, plan.pin("").c_str(), about);
        } else {
            unsigned_.emplace(plan.component, plan.writes, plan.pin("").c_str(), about);
        }
    }

    void write(const SlaveImage& image) noexcept override {
        object_.step(image);
        const std::int64_t value =
            signed_ ? std::int64_t{signed_->get()} : std::int64_t{unsigned_->get()};
        const bool linked = signed_ ? signed_->linked() : unsigned_->linked();
        used_ = used_ || linked || value != 0;
        if (used_ && object_.known() && value != object_.value()) {
            object_.write(image, value);
        }
    }
    void restart() noexcept override { object_.restart(); }

private:
    ObjectRequest object_;
    std::optional<In<std::int32_t>> signed_;
    std::optional<In<std::uint32_t>> unsigned_;
    bool used_ = false;
};

}  // namespace hal::ethercat
