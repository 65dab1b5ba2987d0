// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>

#include "ethercat/plugins/channels/enable_sequence.hpp"
#include "ethercat/plugins/channels/object_request.hpp"
#include "ethercat/plugins/channels/position_encoder.hpp"

namespace hal::ethercat {

/// A servo terminal in velocity mode that one pin enables, as the EL7211:
///
///     target = velo-cmd-out * scale * vel-resolution
///
/// velo-cmd-out follows velo-cmd within min-vel, max-vel and max-accel. The resolutions are read
/// from the terminal; until then the target is 0.
class VelocityDrive final : public Channel {
public:
    explicit VelocityDrive(const ChannelPlan& plan)
        : status_field_(plan.field("status")),
          control_field_(plan.field("control")),
          target_field_(plan.field("target")),
          velocity_field_(plan.field("velocity")),
          position_field_(plan.field("position")),
          enable_(plan.component, plan.writes, plan.pin("enable").c_str(), "enables the drive"),
          enabled_(plan, "enabled", "the drive is in operation"),
          fault_(plan, "fault", "the drive is enabled and has a fault"),
          ready_(plan, "status-ready", "ready to switch on"),
          switched_on_(plan, "status-switched-on", "switched on"),
          operation_(plan, "status-operation", "operation enabled"),
          status_fault_(plan, "status-fault", "the drive has a fault, or is not operational"),
          disabled_(plan, "status-disabled", "switching on is disabled"),
          warning_(plan, "status-warning", "the drive has a warning"),
          limit_(plan, "status-limit-active", "a limit is active"),
          command_(plan.component, plan.writes, plan.pin("velo-cmd").c_str(), "requested velocity"),
          command_out_(plan.component, plan.writes, plan.pin("velo-cmd-out").c_str(),
                       "velocity within the limits"),
          command_raw_(plan.component, plan.writes, plan.pin("velo-cmd-out-raw").c_str(),
                       "the same for the slave"),
          velocity_(plan.component, plan.reads, plan.pin("velo-fb").c_str(), "actual velocity"),
          rpm_(plan.component, plan.reads, plan.pin("velo-fb-rpm").c_str(), "actual speed",
               {.unit = "rpm"}),
          rpm_abs_(plan.component, plan.reads, plan.pin("velo-fb-rpm-abs").c_str(),
                   "actual speed, absolute", {.unit = "rpm"}),
          velocity_raw_(plan.component, plan.reads, plan.pin("velo-fb-raw").c_str(),
                        "actual velocity of the slave"),
          at_speed_(plan, "at-speed",
                    "velo-fb is within at-speed-window of velo-cmd, and the drive is operational"),
          scale_(plan.component, plan.reads, plan.pin("scale").c_str(),
                 "turns of one unit of the position", {.initial = 1.0}),
          velocity_resolution_(plan.component, plan.reads, plan.pin("vel-resolution").c_str(),
                               "value of one turn per second, of the slave"),
          position_resolution_(plan.component, plan.reads, plan.pin("pos-resolution").c_str(),
                               "steps of one turn, of the slave"),
          min_velocity_(plan.component, plan.writes, plan.pin("min-vel").c_str(),
                        "smallest velocity", {.initial = -1e20}),
          max_velocity_(plan.component, plan.writes, plan.pin("max-vel").c_str(),
                        "largest velocity", {.initial = 1e20}),
          max_acceleration_(plan.component, plan.writes, plan.pin("max-accel").c_str(),
                            "largest acceleration", {.initial = 1e20}),
          window_(plan.component, plan.reads, plan.pin("at-speed-window").c_str(), "of at-speed"),
          encoder_(plan, "enc", 32) {}

    void read(const SlaveImage& image) noexcept override {
        read_resolutions(image);
        status_ = image.operational ? static_cast<std::uint16_t>(status_field_.read(image)) : 0;
        ready_.pin = bit(0);
        switched_on_.pin = bit(1);
        operation_.pin = bit(2);
        disabled_.pin = bit(6);
        warning_.pin = bit(7);
        limit_.pin = bit(11);
        enabled_.pin = bit(0) && bit(1) && bit(2);
        status_fault_.pin = bit(3) || !image.operational;
        if (!image.operational) {
            at_speed_.pin = false;  // the velocity is that of before
            return;
        }
        show_fault(image.period_ns);
        const auto raw = static_cast<std::int32_t>(velocity_field_.read_signed(image));
        const double scale = usable_scale(scale_);
        const double turns =
            velocity_resolution_ > 0 ? static_cast<double>(raw) / velocity_resolution_.get() : 0.0;
        velocity_raw_ = raw;
        velocity_ = turns / scale;
        rpm_ = turns * 60.0;
        rpm_abs_ = std::fabs(turns * 60.0);
        at_speed_.pin = std::fabs(velocity_ - command_.get()) <= window_;
        encoder_.update(position_field_.read(image), position_resolution_.get(), 1.0 / scale);
    }

    void write(const SlaveImage& image) noexcept override {
        const double wanted = enable_ ? command_.get() : 0.0;
        const double low = std::min(min_velocity_.get(), max_velocity_.get());
        const double limited = enable_ ? std::clamp(wanted, low, max_velocity_.get()) : 0.0;
        const double step =
            std::fabs(max_acceleration_) * static_cast<double>(image.period_ns) * 1e-9;
        const double last = command_out_;
        if (std::isfinite(limited) && std::isfinite(step)) {
            command_out_ = std::clamp(limited, last - step, last + step);
        }
        control_field_.write(image, control());
        const double raw = command_out_ * usable_scale(scale_) * velocity_resolution_.get();
        command_raw_ = static_cast<std::int32_t>(target_field_.write_limited(image, raw));
    }
    void restart() noexcept override {
        velocity_object_.restart();
        position_object_.restart();
    }

private:
    struct Bit {
        Bit(const ChannelPlan& plan, const char* suffix, const char* doc)
            : pin(plan.component, plan.reads, plan.pin(suffix).c_str(), doc) {}
        Out<bool> pin;
    };
    static constexpr std::int64_t reset_ns = 100'000'000;

    bool bit(unsigned number) const noexcept { return (status_ >> number & 1U) != 0; }

    void read_resolutions(const SlaveImage& image) noexcept {
        velocity_object_.step(image);
        position_object_.step(image);
        if (velocity_object_.known()) {
            velocity_resolution_ = static_cast<std::uint32_t>(velocity_object_.value());
        }
        if (position_object_.known()) {
            position_resolution_ = static_cast<std::uint32_t>(position_object_.value());
        }
    }
    /// A fault is shown once the reset that enabling begins has failed for 100 ms.
    void show_fault(std::int64_t period_ns) noexcept {
        const bool faulty = enable_ && bit(3);
        if (!faulty) {
            reset_left_ns_ = reset_ns;
            fault_.pin = false;
            return;
        }
        fault_.pin = reset_left_ns_ <= 0;
        reset_left_ns_ = std::max<std::int64_t>(0, reset_left_ns_ - period_ns);
    }
    /// The drive stays enabled until it has braked.
    std::uint16_t control() const noexcept {
        if (!enable_ && command_out_.get() == 0.0) return 0;
        if (bit(3)) return controlword::fault_reset;
        constexpr std::uint16_t shutdown = controlword::enable_voltage | controlword::quick_stop;
        if (bit(6)) return shutdown;
        if (!bit(0)) return 0;
        const std::uint16_t on = shutdown | controlword::switch_on;
        return bit(1) ? static_cast<std::uint16_t>(on | controlword::enable_operation) : on;
    }

    ImageField status_field_, control_field_, target_field_, velocity_field_, position_field_;
    ObjectRequest velocity_object_{0x9010, 0x14, 32, false};
    ObjectRequest position_object_{0x9010, 0x15, 32, false};
    In<bool> enable_;
    Bit enabled_, fault_, ready_, switched_on_, operation_, status_fault_, disabled_, warning_;
    Bit limit_;
    In<double> command_;
    Out<double> command_out_;
    Out<std::int32_t> command_raw_;
    Out<double> velocity_, rpm_, rpm_abs_;
    Out<std::int32_t> velocity_raw_;
    Bit at_speed_;
    Param<double> scale_;
    Out<std::uint32_t> velocity_resolution_, position_resolution_;
    Param<double> min_velocity_, max_velocity_, max_acceleration_, window_;
    PositionEncoder encoder_;
    std::uint16_t status_ = 0;
    std::int64_t reset_left_ns_ = reset_ns;
};

}  // namespace hal::ethercat
