// SPDX-License-Identifier: MIT
#pragma once

#include "ethercat/plugins/channels/channel.hpp"

namespace hal::ethercat {

/// A pulse train output in position mode, as the EL2522:
///
///     target = pos-cmd * pos-scale        pos-fb += counted pulses / pos-scale
///
/// A new pos-scale moves neither position.
class PulseTrain final : public Channel {
public:
    explicit PulseTrain(const ChannelPlan& plan)
        : count_field_(plan.field("count")),
          enable_field_(plan.field("enable")),
          target_field_(plan.field("target")),
          command_(plan.component, plan.writes, plan.pin("pos-cmd").c_str(), "requested position"),
          feedback_(plan.component, plan.reads, plan.pin("pos-fb").c_str(), "counted position"),
          count_(plan.component, plan.reads, plan.pin("count").c_str(), "counted pulses"),
          enable_(plan.component, plan.writes, plan.pin("enable").c_str(), "enables the output"),
          scale_(plan.component, plan.writes, plan.pin("pos-scale").c_str(),
                 "pulses of one unit of the position", {.initial = 1.0}) {}

    void read(const SlaveImage& image) noexcept override {
        const auto raw = static_cast<std::uint32_t>(count_field_.read(image));
        const auto counted = static_cast<std::int32_t>(raw - last_raw_);
        last_raw_ = raw;
        if (image.operational && was_operational_) {
            count_ = static_cast<std::int32_t>(static_cast<std::uint32_t>(count_.get()) +
                                               static_cast<std::uint32_t>(counted));
            feedback_ = feedback_ + counted / last_scale_;
        }
        was_operational_ = image.operational;
    }

    void write(const SlaveImage& image) noexcept override {
        const double scale = scale_;
        const bool usable = std::isfinite(scale) && std::fabs(scale) >= 1e-20;
        if (scale != last_scale_ && usable) {
            last_scale_ = scale;
            offset_ = count_ - feedback_ * scale;
        }
        const double target = std::round(command_ * last_scale_ + offset_);
        if (std::isfinite(target)) {
            target_field_.write(image,
                                static_cast<std::uint64_t>(static_cast<std::int64_t>(target)));
        }
        enable_field_.write(image, enable_ ? 1 : 0);
    }

private:
    ImageField count_field_, enable_field_, target_field_;
    In<double> command_;
    Out<double> feedback_;
    Out<std::int32_t> count_;
    In<bool> enable_;
    Param<double> scale_;
    double last_scale_ = 1.0;
    double offset_ = 0.0;
    std::uint32_t last_raw_ = 0;
    bool was_operational_ = false;
};

}  // namespace hal::ethercat
