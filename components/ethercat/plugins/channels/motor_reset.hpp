// SPDX-License-Identifier: MIT
#pragma once

#include "ethercat/plugins/channels/channel.hpp"

namespace hal::ethercat {

/// The fault of a motor terminal, as the EL7041: `reset` and `fault-reset` reset it, and so does
/// enabling the motor, once, during which the fault is not shown.
class MotorReset final : public Channel {
public:
    explicit MotorReset(const ChannelPlan& plan)
        : error_field_(plan.field("error")),
          enable_field_(plan.field("enable")),
          reset_field_(plan.field("reset")),
          reset_(plan.component, plan.writes, plan.pin("reset").c_str(), "resets a fault"),
          fault_(plan.component, plan.reads, plan.pin("fault").c_str(),
                 "the drive has a fault that is not being reset"),
          fault_reset_(plan.component, plan.writes, plan.pin("fault-reset").c_str(),
                       "resets a fault") {}

    void read(const SlaveImage& image) noexcept override {
        if (!image.operational) return;
        error_ = error_field_.read_bit(image);
        if (!error_) {
            resets_for_ = 0;
        }
        if (resets_for_ > 0) {
            --resets_for_;
        }
        fault_ = error_ && resets_for_ == 0;
    }

    void write(const SlaveImage& image) noexcept override {
        // AnalogOutput, which is before it in the slave, has written the enable bit of this cycle.
        const bool enable = enable_field_.read_bit(image);
        const bool rose = enable && !last_enable_;
        last_enable_ = enable;
        if (rose && error_) {
            resets_for_ = reset_cycles;
        }
        const bool resets = reset_ || fault_reset_ || resets_for_ > reset_cycles / 2;
        reset_field_.write(image, resets ? 1 : 0);
    }

private:
    static constexpr int reset_cycles = 4;
    ImageField error_field_, enable_field_, reset_field_;
    In<bool> reset_;
    Out<bool> fault_;
    In<bool> fault_reset_;
    int resets_for_ = 0;
    bool error_ = false;
    bool last_enable_ = false;
};

}  // namespace hal::ethercat
