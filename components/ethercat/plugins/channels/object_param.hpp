// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>

#include "ethercat/plugins/channels/object_request.hpp"

namespace hal::ethercat {

/// An object that is not in the process data, as the parameter NAME of type s32, within the
/// settings `min` and `max`. It begins with the setting `initial`, and is written by SDO once it
/// has had another value; until then the slave keeps what it has.
class ObjectParam final : public Channel {
public:
    explicit ObjectParam(const ChannelPlan& plan)
        : object_(plan),
          initial_(static_cast<std::int32_t>(plan.channel.setting("initial", 0))),
          min_(static_cast<std::int32_t>(plan.channel.setting("min", 0))),
          max_(static_cast<std::int32_t>(plan.channel.setting("max", 0))),
          param_(plan.component, plan.writes, plan.pin("").c_str(),
                 "written by SDO when it changes", {.initial = initial_}) {}

    void write(const SlaveImage& image) noexcept override {
        object_.step(image);
        used_ = used_ || param_ != initial_;
        const std::int64_t value = std::clamp(param_.get(), min_, max_);
        if (used_ && object_.known() && value != object_.value()) {
            object_.write(image, value);
        }
    }
    void restart() noexcept override { object_.restart(); }

private:
    ObjectRequest object_;
    const std::int32_t initial_, min_, max_;
    Param<std::int32_t> param_;
    bool used_ = false;
};

}  // namespace hal::ethercat
