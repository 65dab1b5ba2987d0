// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>

#include "ethercat/plugins/channels/channel.hpp"
#include "ethercat/plugins/channels/enable_sequence.hpp"

namespace hal::ethercat {

/// A frequency inverter in the velocity mode of CiA 402, as the Delta MS300:
///
///     target = vel-rpm-cmd * vel-scale        vel-fb-rpm = actual velocity / vel-scale
class Inverter final : public Channel {
public:
    explicit Inverter(const ChannelPlan& plan)
        : status_field_(plan.field("status")),
          control_field_(plan.field("control")),
          target_field_(plan.field("target")),
          velocity_field_(plan.field("velocity")),
          mode_field_(plan.field("mode")),
          mode_display_field_(plan.field("mode-display")),
          rpm_(plan.component, plan.reads, "vel-fb-rpm", plan, "actual speed"),
          rpm_abs_(plan.component, plan.reads, "vel-fb-rpm-abs", plan, "actual speed, absolute"),
          ready_(plan, "stat-switch-on-ready", "ready to switch on"),
          switched_on_(plan, "stat-switched-on", "switched on"),
          enabled_(plan, "stat-op-enabled", "operation enabled"),
          fault_(plan, "stat-fault", "the drive has a fault, or is not operational"),
          voltage_(plan, "stat-volt-enabled", "the voltage is enabled"),
          quick_stop_(plan, "stat-quick-stoped", "bit 5 of the status word"),
          disabled_(plan, "stat-switch-on-disabled", "switching on is disabled"),
          warning_(plan, "stat-warning", "the drive has a warning"),
          remote_(plan, "stat-remote", "the drive follows its control word"),
          at_speed_(plan, "stat-at-speed", "the target speed is reached"),
          quick_stop_request_(plan.component, plan.writes, plan.pin("quick-stop").c_str(),
                              "stops the drive"),
          enable_(plan.component, plan.writes, plan.pin("enable").c_str(), "enables the drive"),
          fault_reset_(plan.component, plan.writes, plan.pin("fault-reset").c_str(),
                       "resets a fault"),
          halt_(plan.component, plan.writes, plan.pin("halt").c_str(), "halts the drive"),
          command_(plan.component, plan.writes, plan.pin("vel-rpm-cmd").c_str(), "requested speed"),
          resets_itself_(plan.component, plan.writes, plan.pin("auto-fault-reset").c_str(),
                         "enabling the drive resets a fault", {.initial = true}),
          scale_(plan.component, plan.reads, plan.pin("vel-scale").c_str(),
                 "units of the drive of 1 rpm", {.initial = 1.0}) {}

    void read(const SlaveImage& image) noexcept override {
        status_ = image.operational ? static_cast<std::uint16_t>(status_field_.read(image)) : 0;
        ready_.show(status_, 0);
        switched_on_.show(status_, 1);
        enabled_.show(status_, 2);
        voltage_.show(status_, 4);
        quick_stop_.show(status_, 5);
        disabled_.show(status_, 6);
        warning_.show(status_, 7);
        remote_.show(status_, 9);
        at_speed_.show(status_, 10);
        if (!image.operational) {
            fault_.pin = true;
            return;
        }
        const bool wrong_mode = mode_display_field_.read_signed(image) != velocity_mode;
        const bool fault = (status_ & statusword::fault) != 0 || wrong_mode;
        fault_.pin = sequence_.shows(fault, image.period_ns);
        const double rpm =
            static_cast<double>(velocity_field_.read_signed(image)) / usable_scale(scale_);
        rpm_.pin = rpm;
        rpm_abs_.pin = std::fabs(rpm);
    }

    void write(const SlaveImage& image) noexcept override {
        mode_field_.write(image, velocity_mode);
        std::uint16_t control = sequence_.control(status_, enable_, fault_reset_, resets_itself_);
        if ((status_ & statusword::operation_enabled) != 0) {
            control |= controlword::ramp;
        }
        if (quick_stop_request_) {
            control &= static_cast<std::uint16_t>(~controlword::quick_stop);
        }
        if (halt_) {
            control |= controlword::halt;
        }
        control_field_.write(image, control);
        target_field_.write_limited(image, command_ * usable_scale(scale_));
    }

private:
    static constexpr int velocity_mode = 2;
    struct Bit {
        Bit(const ChannelPlan& plan, const char* suffix, const char* doc)
            : pin(plan.component, plan.reads, plan.pin(suffix).c_str(), doc) {}
        void show(std::uint16_t status, unsigned bit) noexcept { pin = (status >> bit & 1U) != 0; }
        Out<bool> pin;
    };
    struct Speed {
        Speed(hal::Component& component, const hal::Function& reads, const char* suffix,
              const ChannelPlan& plan, const char* doc)
            : pin(component, reads, plan.pin(suffix).c_str(), doc, {.unit = "rpm"}) {}
        Out<double> pin;
    };

    ImageField status_field_, control_field_, target_field_, velocity_field_, mode_field_;
    ImageField mode_display_field_;
    Speed rpm_, rpm_abs_;
    Bit ready_, switched_on_, enabled_, fault_, voltage_, quick_stop_, disabled_, warning_;
    Bit remote_, at_speed_;
    In<bool> quick_stop_request_, enable_, fault_reset_, halt_;
    In<double> command_;
    Param<bool> resets_itself_;
    Param<double> scale_;
    EnableSequence sequence_;
    std::uint16_t status_ = 0;
};

}  // namespace hal::ethercat
