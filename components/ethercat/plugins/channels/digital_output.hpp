// SPDX-License-Identifier: MIT
#pragma once

#include <optional>

#include "ethercat/plugins/channels/channel.hpp"

namespace hal::ethercat {

/// A bit that the pin NAME sets; the parameter NAME-invert inverts it, unless `invert=0`.
class DigitalOutput final : public Channel {
public:
    explicit DigitalOutput(const ChannelPlan& plan)
        : field_(plan.field("out")),
          out_(plan.component, plan.writes, plan.pin("").c_str(), "the output") {
        if (plan.channel.setting("invert", 1) != 0) {
            invert_.emplace(plan.component, plan.writes, plan.pin("invert").c_str(),
                            "inverts the output");
        }
    }

    void write(const SlaveImage& image) noexcept override {
        const bool inverted = invert_ && invert_->get();
        field_.write(image, out_.get() != inverted ? 1 : 0);
    }

private:
    ImageField field_;
    In<bool> out_;
    std::optional<Param<bool>> invert_;
};

}  // namespace hal::ethercat
