// SPDX-License-Identifier: MIT
#pragma once

#include "ethercat/plugins/channels/channel.hpp"

namespace hal::ethercat {

/// A stepper terminal in position mode, as the EL7031: target = pos-cmd * pos-scale. After
/// auto-reduce-torque-delay seconds without a new target the current is reduced.
class StepperDrive final : public Channel {
public:
    explicit StepperDrive(const ChannelPlan& plan)
        : enable_field_(plan.field("enable")),
          reset_field_(plan.field("reset")),
          reduce_field_(plan.field("reduce")),
          target_field_(plan.field("target")),
          enable_(plan.component, plan.writes, plan.pin("srv-enable").c_str(), "enables the drive"),
          reset_(plan.component, plan.writes, plan.pin("srv-reset").c_str(), "resets a fault"),
          reduce_(plan.component, plan.writes, plan.pin("srv-reduce-torque").c_str(),
                  "reduces the current"),
          command_(plan.component, plan.writes, plan.pin("srv-pos-cmd").c_str(),
                   "requested position"),
          raw_command_(plan.component, plan.writes, plan.pin("srv-pos-cmd-raw").c_str(),
                       "requested position, steps"),
          scale_(plan.component, plan.writes, plan.pin("srv-pos-scale").c_str(),
                 "steps of one unit of the position", {.initial = 1.0}),
          unused_(plan.component, plan.writes, plan.pin("auto-fault-reset").c_str(),
                  "without effect, as in lcec", {.initial = true}),
          delay_(plan.component, plan.writes, plan.pin("auto-reduce-torque-delay").c_str(),
                 "time until the current is reduced; 0: never", {.unit = "s"}) {}

    void write(const SlaveImage& image) noexcept override {
        const std::int64_t target = target_field_.write_limited(image, command_ * scale_);
        raw_command_ = static_cast<std::int32_t>(target);
        const bool moved = target != last_target_;
        last_target_ = target;
        if (moved || !enable_) {
            rests_ns_ = 0;
        }
        bool reduced = reduce_;
        if (delay_ > 0.0) {
            const bool waits = static_cast<double>(rests_ns_) < delay_ * 1e9;
            reduced = reduced || !waits;
            rests_ns_ += waits ? image.period_ns : 0;
        }
        enable_field_.write(image, enable_ ? 1 : 0);
        reduce_field_.write(image, reduced ? 1 : 0);
        reset_field_.write(image, reset_ ? 1 : 0);
    }

private:
    ImageField enable_field_, reset_field_, reduce_field_, target_field_;
    In<bool> enable_, reset_, reduce_;
    In<double> command_;
    Out<std::int32_t> raw_command_;
    Param<double> scale_;
    Param<bool> unused_;
    Param<double> delay_;
    std::int64_t last_target_ = 0;
    std::int64_t rests_ns_ = 0;
};

}  // namespace hal::ethercat
