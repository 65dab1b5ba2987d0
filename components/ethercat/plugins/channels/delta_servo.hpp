// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <memory>
#include <optional>

#include "ethercat/plugins/channels/channel.hpp"
#include "ethercat/plugins/channels/enable_sequence.hpp"
#include "ethercat/plugins/channels/position_encoder.hpp"

namespace hal::ethercat {

/// The Delta ASDA servo drives, in cyclic synchronous velocity mode (the setting `velocity-mode`)
/// or position mode. The bits of the control word are pins.
class DeltaServo final : public Channel {
public:
    explicit DeltaServo(const ChannelPlan& plan)
        : velocity_mode_(plan.channel.setting("velocity-mode", 0) != 0),
          status_field_(plan.field("status")),
          control_field_(plan.field("control")),
          target_field_(plan.field("target")),
          velocity_field_(plan.field("velocity")),
          position_field_(plan.field("position")),
          external_field_(plan.field("external")),
          torque_field_(plan.field("torque")),
          velocity_(plan.component, plan.reads, plan.pin("srv-vel-fb").c_str(), "actual velocity"),
          rpm_(plan.component, plan.reads, plan.pin("srv-vel-fb-rpm").c_str(), "actual speed",
               {.unit = "rpm"}),
          rpm_abs_(plan.component, plan.reads, plan.pin("srv-vel-fb-rpm-abs").c_str(),
                   "actual speed, absolute", {.unit = "rpm"}),
          rpm_command_(plan.component, plan.writes, plan.pin("srv-vel-rpm").c_str(),
                       "requested speed", {.unit = "rpm"}),
          ready_(plan, "srv-ready", "ready to switch on"),
          switched_on_(plan, "srv-switched-on", "switched on"),
          enabled_(plan, "srv-oper-enabled", "operation enabled"),
          fault_(plan, "srv-fault", "the drive has a fault, or is not operational"),
          voltage_(plan, "srv-volt-enabled", "the voltage is enabled"),
          quick_stopped_(plan, "srv-quick-stoped", "the drive makes a quick stop"),
          disabled_(plan, "srv-on-disabled", "switching on is disabled"),
          warning_(plan, "srv-warning", "the drive has a warning"),
          remote_(plan, "srv-remote", "the drive follows its control word"),
          at_speed_(plan, "srv-at-speed", "the target is reached"),
          limit_(plan, "srv-limit-active", "a limit is active"),
          zero_speed_(plan, "srv-zero-speed", "bit 12 of the status word"),
          switch_on_(plan, plan.writes, "srv-switch-on", "bit 0 of the control word"),
          enable_voltage_(plan, plan.writes, "srv-enable-volt", "bit 1 of the control word"),
          quick_stop_(plan, plan.writes, "srv-quick-stop", "makes a quick stop"),
          enable_(plan, plan.writes, "srv-enable", "bit 3 of the control word, once switched on"),
          fault_reset_(plan, plan.writes, "srv-fault-reset", "resets a fault"),
          halt_(plan, plan.writes, "srv-halt", "halts the drive"),
          mode_(plan.component, plan.reads, plan.pin("srv-operation-mode").c_str(),
                "mode of operation", {.initial = velocity_mode_ ? 9U : 8U}),
          torque_(plan.component, plan.reads, plan.pin("srv-torque-rel").c_str(), "actual torque",
                  {.unit = "%"}),
          command_(plan.component, plan.writes,
                   plan.pin(velocity_mode_ ? "srv-vel-cmd" : "srv-pos-cmd").c_str(),
                   velocity_mode_ ? "requested velocity" : "requested position"),
          scale_(plan.component, plan.reads, plan.pin("pos-scale").c_str(), "position of one turn",
                 {.initial = 1.0}),
          external_scale_(plan.component, plan.reads, plan.pin("extenc-scale").c_str(),
                          "position of one step of the external encoder", {.initial = 1.0}),
          steps_(plan.component, plan.reads, plan.pin("srv-pulses-per-rev").c_str(),
                 "steps of one turn",
                 {.initial = static_cast<std::uint32_t>(plan.channel.setting("steps", 1280000))}),
          reset_cycles_(plan.component, plan.writes, plan.pin("srv-fault-autoreset-cycles").c_str(),
                        "cycles of each state of the fault reset", {.initial = 100}),
          reset_retries_(plan.component, plan.writes,
                         plan.pin("srv-fault-autoreset-retries").c_str(),
                         "how often switching on resets a fault; 0: never", {.initial = 3}),
          encoder_(plan, "enc", 32),
          external_encoder_(plan, "extenc", 32) {}

    void read(const SlaveImage& image) noexcept override {
        status_ = image.operational ? static_cast<std::uint16_t>(status_field_.read(image))
                                    : quick_stop_inactive;
        ready_.pin = bit(0);
        switched_on_.pin = bit(1);
        enabled_.pin = bit(2);
        voltage_.pin = bit(4);
        quick_stopped_.pin = !bit(5);
        disabled_.pin = bit(6);
        warning_.pin = bit(7);
        remote_.pin = bit(9);
        at_speed_.pin = bit(10);
        limit_.pin = bit(11);
        zero_speed_.pin = bit(12);
        if (!image.operational) {
            fault_.pin = true;
            return;
        }
        count_reset();
        fault_.pin = bit(3) && resets_left_ == 0;

        const double scale = usable_scale(scale_);
        const double rpm = static_cast<double>(velocity_field_.read_signed(image)) * rpm_of_step;
        rpm_ = rpm;
        rpm_abs_ = std::fabs(rpm);
        velocity_ = rpm / seconds_per_minute * scale;
        encoder_.update(position_field_.read(image), steps_.get(), scale);
        external_encoder_.update(external_field_.read(image), 1, external_scale_);
        torque_ = static_cast<double>(torque_field_.read_signed(image)) * 0.1;
    }

    void write(const SlaveImage& image) noexcept override {
        const bool rose = switch_on_.pin && !last_switch_on_;
        last_switch_on_ = switch_on_.pin;
        if (rose && bit(3) && reset_cycles_ > 0) {
            resets_left_ = reset_retries_;
            cycles_ = 0;
            resets_now_ = true;
        }
        control_field_.write(image, control());
        const double scale = usable_scale(scale_);
        if (velocity_mode_) {
            const double rpm = command_ / scale * seconds_per_minute;
            rpm_command_ = rpm;
            target_field_.write_limited(image, rpm / rpm_of_step);
        } else {
            target_field_.write_limited(image, command_ * steps_.get() / scale);
        }
    }

private:
    static constexpr double rpm_of_step = 0.1;
    static constexpr double seconds_per_minute = 60.0;
    static constexpr std::uint16_t quick_stop_inactive = 0x0020;
    struct Bit {
        Bit(const ChannelPlan& plan, const char* suffix, const char* doc)
            : pin(plan.component, plan.reads, plan.pin(suffix).c_str(), doc) {}
        Out<bool> pin;
    };
    struct Request {
        Request(const ChannelPlan& plan, const hal::Function& writes, const char* suffix,
                const char* doc)
            : pin(plan.component, writes, plan.pin(suffix).c_str(), doc) {}
        In<bool> pin;
    };

    bool bit(unsigned number) const noexcept { return (status_ >> number & 1U) != 0; }

    /// Alternates the reset bit, `reset_cycles_` cycles each, until the fault has gone.
    void count_reset() noexcept {
        if (!bit(3)) {
            resets_left_ = 0;
        }
        if (resets_left_ == 0) return;
        if (++cycles_ <= reset_cycles_) return;
        cycles_ = 0;
        resets_now_ = !resets_now_;
        if (resets_now_) {
            --resets_left_;
        }
    }
    std::uint16_t control() const noexcept {
        std::uint16_t word = 0;
        if (enable_voltage_.pin) {
            word |= controlword::enable_voltage;
        }
        if (!quick_stop_.pin) {
            word |= controlword::quick_stop;
        }
        if (halt_.pin) {
            word |= controlword::halt;
        }
        const bool own_reset = resets_left_ > 0;
        if (fault_reset_.pin || (own_reset && resets_now_)) {
            word |= controlword::fault_reset;
        }
        if (own_reset) return word;
        if (switch_on_.pin) {
            word |= controlword::switch_on;
        }
        if (enable_.pin && bit(1)) {
            word |= controlword::enable_operation;
        }
        return word;
    }

    const bool velocity_mode_;
    ImageField status_field_, control_field_, target_field_, velocity_field_, position_field_;
    ImageField external_field_, torque_field_;
    Out<double> velocity_, rpm_, rpm_abs_, rpm_command_;
    Bit ready_, switched_on_, enabled_, fault_, voltage_, quick_stopped_, disabled_, warning_;
    Bit remote_, at_speed_, limit_, zero_speed_;
    Request switch_on_, enable_voltage_, quick_stop_, enable_, fault_reset_, halt_;
    Out<std::uint32_t> mode_;
    Out<double> torque_;
    In<double> command_;
    Param<double> scale_, external_scale_;
    Param<std::uint32_t> steps_, reset_cycles_, reset_retries_;
    PositionEncoder encoder_, external_encoder_;
    std::uint16_t status_ = 0;
    std::uint32_t resets_left_ = 0;
    std::uint32_t cycles_ = 0;
    bool resets_now_ = false;
    bool last_switch_on_ = false;
};

}  // namespace hal::ethercat
