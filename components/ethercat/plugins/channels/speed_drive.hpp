// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>

#include "ethercat/plugins/channels/object_request.hpp"
#include "ethercat/plugins/channels/position_encoder.hpp"

namespace hal::ethercat {

/// A drive with a relative speed set-point, as Stöber's MDS 5000:
///
///     srv-vel-rpm = clamp(srv-vel-cmd * srv-pos-scale * 60, -srv-max-rpm, srv-max-rpm)
///     set-point   = srv-vel-rpm / srv-max-rpm-sp * full scale
///
/// Full scale is 200 %, in 15 bits and a sign. The reference torque (B18, 0.01 Nm), the largest
/// speed (C01) and the speed of 100 % (D02) are read from the drive; until then the set-point is 0.
/// The settings `bits`, and `external-bits`, `external-shift` and `external-turn` of a second
/// encoder with the role `external`, describe the positions.
class SpeedDrive final : public Channel {
public:
    explicit SpeedDrive(const ChannelPlan& plan)
        : state_field_(plan.field("state")),
          speed_field_(plan.field("speed")),
          torque_field_(plan.field("torque")),
          speed_state_field_(plan.field("speed-state")),
          position_field_(plan.field("position")),
          external_field_(plan.field("external")),
          control_field_(plan.field("control")),
          set_point_field_(plan.field("set-point")),
          torque_limit_field_(plan.field("torque-limit")),
          external_shift_(static_cast<unsigned>(plan.channel.setting("external-shift", 0))),
          external_turn_(static_cast<std::uint64_t>(plan.channel.setting("external-turn", 0))),
          command_(plan.component, plan.writes, plan.pin("srv-vel-cmd").c_str(),
                   "requested velocity"),
          velocity_(plan.component, plan.reads, plan.pin("srv-vel-fb").c_str(), "actual velocity"),
          rpm_(plan.component, plan.reads, plan.pin("srv-vel-fb-rpm").c_str(), "actual speed",
               {.unit = "rpm"}),
          rpm_magnitude_(plan.component, plan.reads, plan.pin("srv-vel-fb-rpm-abs").c_str(),
                         "actual speed, absolute", {.unit = "rpm"}),
          rpm_command_(plan.component, plan.writes, plan.pin("srv-vel-rpm").c_str(),
                       "requested speed within the limits", {.unit = "rpm"}),
          torque_(plan.component, plan.reads, plan.pin("srv-torque-fb").c_str(), "actual torque",
                  {.unit = "Nm"}),
          torque_magnitude_(plan.component, plan.reads, plan.pin("srv-torque-fb-abs").c_str(),
                            "actual torque, absolute", {.unit = "Nm"}),
          torque_percent_(plan.component, plan.reads, plan.pin("srv-torque-fb-pct").c_str(),
                          "actual torque, absolute, of the reference torque", {.unit = "%"}),
          torque_limit_(plan.component, plan.writes, plan.pin("srv-torque-lim").c_str(),
                        "largest torque; 1 is the reference torque, at most 2", {.initial = 1.0}),
          stopped_(plan.component, plan.reads, plan.pin("srv-stopped").c_str(),
                   "speed 0 is reached"),
          at_speed_(plan.component, plan.reads, plan.pin("srv-at-speed").c_str(),
                    "the set-point is reached"),
          overload_(plan.component, plan.reads, plan.pin("srv-overload").c_str(),
                    "the torque is at its limit"),
          ready_(plan.component, plan.reads, plan.pin("srv-ready").c_str(), "ready to be enabled"),
          error_(plan.component, plan.reads, plan.pin("srv-error").c_str(),
                 "the drive has an error, or is not operational"),
          toggle_(plan.component, plan.reads, plan.pin("srv-toggle").c_str(),
                  "toggle bit of the drive, which is returned inverted"),
          local_(plan.component, plan.reads, plan.pin("srv-loc-ena").c_str(), "local operation"),
          enable_(plan.component, plan.writes, plan.pin("srv-enable").c_str(), "enables the drive"),
          reset_(plan.component, plan.writes, plan.pin("srv-err-reset").c_str(), "resets errors"),
          fast_ramp_(plan.component, plan.writes, plan.pin("srv-fast-ramp").c_str(),
                     "selects the fast ramp"),
          brake_(plan.component, plan.writes, plan.pin("srv-brake").c_str(), "releases the brake"),
          scale_(plan.component, plan.reads, plan.pin("srv-pos-scale").c_str(),
                 "turns of one unit of the position", {.initial = 1.0}),
          reference_torque_(plan.component, plan.reads, plan.pin("srv-torque-ref").c_str(),
                            "reference torque, of the drive", {.unit = "Nm"}),
          max_rpm_(plan.component, plan.reads, plan.pin("srv-max-rpm").c_str(),
                   "largest speed, of the drive", {.unit = "rpm"}),
          full_rpm_(plan.component, plan.reads, plan.pin("srv-max-rpm-sp").c_str(),
                    "speed of a set-point of 100 %, of the drive", {.unit = "rpm"}),
          external_scale_(plan.component, plan.reads, plan.pin("extenc-scale").c_str(),
                          "turns, or steps, of one unit of the second position", {.initial = 1.0}),
          encoder_(plan, "enc", static_cast<unsigned>(plan.channel.setting("bits", 24))) {
        if (external_field_.present()) {
            external_.emplace(plan, "extenc",
                              static_cast<unsigned>(plan.channel.setting("external-bits", 32)));
        }
    }

    void read(const SlaveImage& image) noexcept override {
        read_objects(image);
        const auto state = static_cast<unsigned>(state_field_.read(image));
        const auto speed = static_cast<unsigned>(speed_state_field_.read(image));
        const bool valid = image.operational;
        ready_ = valid && (state & 1U) != 0;
        error_ = !valid || (state & 2U) != 0;
        local_ = valid && (state & 0x40U) != 0;
        toggle_ = valid && (state & 0x80U) != 0;
        stopped_ = valid && (speed & 1U) != 0;
        at_speed_ = valid && (speed & 2U) != 0;
        overload_ = valid && (speed & 4U) != 0;
        if (!valid) return;
        const double scale = usable_scale(scale_);
        show_speed(static_cast<double>(speed_field_.read_signed(image)), scale);
        show_torque(static_cast<double>(torque_field_.read_signed(image)));
        encoder_.update(position_field_.read(image), steps_per_turn, 1.0 / scale);
        if (external_) {
            external_->update(external_field_.read(image) >> external_shift_, external_turn_,
                              1.0 / usable_scale(external_scale_));
        }
    }

    void write(const SlaveImage& image) noexcept override {
        control_field_.write(image, control());
        const double limit = torque_limit_;
        if (std::isfinite(limit)) {
            torque_limit_field_.write_limited(image, std::clamp(limit, -2.0, 2.0) * half_scale);
        }
        const double rpm = command_ * usable_scale(scale_) * 60.0;
        if (!std::isfinite(rpm)) return;  // the last set-point stays
        const double max = std::fabs(max_rpm_);
        rpm_command_ = std::clamp(rpm, -max, max);
        const double full = full_rpm_;
        const bool usable = enable_ && std::fabs(full) > 1e-20;
        set_point_field_.write_limited(image,
                                       usable ? rpm_command_.get() / full * half_scale : 0.0);
    }
    void restart() noexcept override {
        for (ObjectRequest* const object : {&torque_object_, &max_object_, &full_object_}) {
            object->restart();
        }
    }

private:
    static constexpr double half_scale = 0.5 * 32767.0;  ///< 100 %
    static constexpr double torque_step = 8.0 / 32767.0;  ///< of the reference torque
    static constexpr std::uint64_t steps_per_turn = 0x1000000;

    void read_objects(const SlaveImage& image) noexcept {
        for (ObjectRequest* const object : {&torque_object_, &max_object_, &full_object_}) {
            object->step(image);
        }
        if (torque_object_.known()) {
            reference_torque_ = static_cast<double>(torque_object_.value()) * 0.01;
        }
        if (max_object_.known()) {
            max_rpm_ = static_cast<double>(max_object_.value());
        }
        if (full_object_.known()) {
            full_rpm_ = static_cast<double>(full_object_.value());
        }
    }
    void show_speed(double raw, double scale) noexcept {
        const double rpm = max_rpm_ * raw / half_scale;
        rpm_ = rpm;
        rpm_magnitude_ = std::fabs(rpm);
        velocity_ = rpm / 60.0 / scale;
    }
    void show_torque(double raw) noexcept {
        const double share = raw * torque_step;
        torque_percent_ = std::fabs(share * 100.0);
        torque_ = share * reference_torque_;
        torque_magnitude_ = std::fabs(torque_);
    }
    std::uint8_t control() const noexcept {
        unsigned word = 0;
        const auto set = [&word](bool value, unsigned bit) {
            word |= value ? bit : 0U;
        };
        set(enable_, 0x01);
        set(reset_, 0x02);
        set(fast_ramp_, 0x04);
        set(brake_, 0x40);
        set(!toggle_, 0x80);
        return static_cast<std::uint8_t>(word);
    }

    ImageField state_field_, speed_field_, torque_field_, speed_state_field_, position_field_;
    ImageField external_field_, control_field_, set_point_field_, torque_limit_field_;
    const unsigned external_shift_;
    const std::uint64_t external_turn_;
    ObjectRequest torque_object_{0x2212, 0, 32, true};
    ObjectRequest max_object_{0x2401, 0, 32, true};
    ObjectRequest full_object_{0x2602, 0, 32, true};
    In<double> command_;
    Out<double> velocity_, rpm_, rpm_magnitude_, rpm_command_;
    Out<double> torque_, torque_magnitude_, torque_percent_;
    In<double> torque_limit_;
    Out<bool> stopped_, at_speed_, overload_, ready_, error_, toggle_, local_;
    In<bool> enable_, reset_, fast_ramp_, brake_;
    Param<double> scale_;
    Out<double> reference_torque_, max_rpm_, full_rpm_;
    Param<double> external_scale_;
    PositionEncoder encoder_;
    std::optional<PositionEncoder> external_;
};

}  // namespace hal::ethercat
