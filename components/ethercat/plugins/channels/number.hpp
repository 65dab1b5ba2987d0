// SPDX-License-Identifier: MIT
#pragma once

#include <optional>

#include "ethercat/plugins/channels/channel.hpp"

namespace hal::ethercat {

/// An object, or bits of it, as the number NAME: s32, or u32 with the setting `unsigned`. It may be
/// an output of the slave, which another slave or a program writes. 0 without an object. With the
/// setting `divisor` it is the quotient, rounded down.
class Number final : public Channel {
public:
    explicit Number(const ChannelPlan& plan)
        : field_(plan.field("val")),
          divisor_(static_cast<std::uint32_t>(plan.channel.setting("divisor", 1))) {
        if (plan.channel.setting("unsigned", 0) != 0) {
            unsigned_.emplace(plan.component, plan.reads, plan.pin("").c_str(),
                              "value of the slave");
        } else {
            signed_.emplace(plan.component, plan.reads, plan.pin("").c_str(), "value of the slave");
        }
    }

    void read(const SlaveImage& image) noexcept override {
        if (unsigned_) {
            *unsigned_ = static_cast<std::uint32_t>(field_.read(image)) / divisor_;
        } else {
            *signed_ =
                static_cast<std::int32_t>(field_.read(image)) / static_cast<std::int32_t>(divisor_);
        }
    }

private:
    ImageField field_;
    const std::uint32_t divisor_;
    std::optional<Out<std::int32_t>> signed_;
    std::optional<Out<std::uint32_t>> unsigned_;
};

}  // namespace hal::ethercat
