// SPDX-License-Identifier: MIT
#pragma once

#include "ethercat/plugins/channels/channel.hpp"
#include "ethercat/plugins/channels/enable_sequence.hpp"

namespace hal::ethercat {

/// A drive in cyclic synchronous position mode that one pin enables, as the Omron drives:
///
///     target = pos-cmd * pos-scale        pos-fb = actual position / pos-scale
class PositionDrive final : public Channel {
public:
    explicit PositionDrive(const ChannelPlan& plan)
        : status_field_(plan.field("status")),
          control_field_(plan.field("control")),
          target_field_(plan.field("target")),
          position_field_(plan.field("position")),
          error_field_(plan.field("following-error")),
          torque_field_(plan.field("torque")),
          command_(plan.component, plan.writes, plan.pin("pos-cmd").c_str(), "requested position"),
          feedback_(plan.component, plan.reads, plan.pin("pos-fb").c_str(), "actual position"),
          following_error_(plan.component, plan.reads, plan.pin("pos-ferr").c_str(),
                           "following error"),
          torque_(plan.component, plan.reads, plan.pin("torque-fb-pct").c_str(), "actual torque",
                  {.unit = "%"}),
          raw_command_(plan.component, plan.writes, plan.pin("pos-cmd-raw").c_str(),
                       "requested position, steps"),
          raw_feedback_(plan.component, plan.reads, plan.pin("pos-fb-raw").c_str(),
                        "actual position, steps"),
          raw_error_(plan.component, plan.reads, plan.pin("pos-ferr-raw").c_str(),
                     "following error, steps"),
          fault_(plan.component, plan.reads, plan.pin("fault").c_str(),
                 "the drive is enabled and has a fault"),
          fault_reset_(plan.component, plan.writes, plan.pin("fault-reset").c_str(),
                       "a fault is being reset"),
          enable_(plan.component, plan.writes, plan.pin("enable").c_str(), "enables the drive"),
          scale_(plan.component, plan.reads, plan.pin("pos-scale").c_str(),
                 "steps of one unit of the position",
                 {.initial = plan.channel.setting("scale", 1.0)}),
          resets_itself_(plan.component, plan.writes, plan.pin("auto-fault-reset").c_str(),
                         "enabling the drive resets a fault", {.initial = true}) {}

    void read(const SlaveImage& image) noexcept override {
        const double scale = usable_scale(scale_);
        status_ = static_cast<std::uint16_t>(status_field_.read(image));
        raw_feedback_ = static_cast<std::int32_t>(position_field_.read_signed(image));
        feedback_ = raw_feedback_.get() / scale;
        raw_error_ = static_cast<std::int32_t>(error_field_.read_signed(image));
        following_error_ = raw_error_.get() / scale;
        torque_ = static_cast<double>(torque_field_.read_signed(image)) * 0.1;
        const bool fault = (status_ & statusword::fault) != 0 && enable_;
        fault_ = sequence_.shows(fault, image.period_ns);
    }

    void write(const SlaveImage& image) noexcept override {
        const std::uint16_t control = sequence_.control(status_, enable_, false, resets_itself_);
        fault_reset_ = (control & controlword::fault_reset) != 0;
        control_field_.write(image, control);
        raw_command_ = static_cast<std::int32_t>(
            target_field_.write_limited(image, command_ * usable_scale(scale_)));
    }

private:
    ImageField status_field_, control_field_, target_field_, position_field_, error_field_;
    ImageField torque_field_;
    In<double> command_;
    Out<double> feedback_, following_error_, torque_;
    Out<std::int32_t> raw_command_, raw_feedback_, raw_error_;
    Out<bool> fault_, fault_reset_;
    In<bool> enable_;
    Param<double> scale_;
    Param<bool> resets_itself_;
    EnableSequence sequence_;
    std::uint16_t status_ = 0;
};

}  // namespace hal::ethercat
