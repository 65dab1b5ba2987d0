// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <optional>

#include "ethercat/plugins/channels/object_request.hpp"
#include "ethercat/plugins/channels/position_encoder.hpp"

namespace hal::ethercat {

/// An axis of a drive of SERCOS over EtherCAT (IEC 61800-7-204) in velocity mode, as the AX5000.
/// The setting `drive` is its number:
///
///     target = srv-velo-cmd * srv-scale * 60 / srv-vel-scale
///
/// The weight of the velocity (S-0-0045 * 10^S-0-0046) and the steps of a turn (S-0-0079) are read
/// from the drive; until then the target is 0.
class SoeDrive final : public Channel {
public:
    explicit SoeDrive(const ChannelPlan& plan)
        : status_field_(plan.field("status")),
          control_field_(plan.field("control")),
          target_field_(plan.field("target")),
          position_field_(plan.field("position")),
          torque_field_(plan.field("torque")),
          second_field_(plan.field("position2")),
          resolution_(idn(plan, 79, 32, false)),
          weight_(idn(plan, 45, 16, false)),
          exponent_(idn(plan, 46, 16, true)),
          enable_(plan.component, plan.writes, plan.pin("srv-enable").c_str(), "enables the drive"),
          enabled_(plan.component, plan.reads, plan.pin("srv-enabled").c_str(),
                   "the drive is in operation"),
          halted_(plan.component, plan.reads, plan.pin("srv-halted").c_str(),
                  "the drive ignores the command"),
          fault_(plan.component, plan.reads, plan.pin("srv-fault").c_str(),
                 "the drive has a fault, is not ready, or is not operational"),
          halt_(plan.component, plan.writes, plan.pin("srv-halt").c_str(), "stops the drive"),
          off_(plan.component, plan.writes, plan.pin("srv-drive-off").c_str(),
               "switches the torque off while the drive is enabled"),
          command_(plan.component, plan.writes, plan.pin("srv-velo-cmd").c_str(),
                   "requested velocity"),
          status_(plan.component, plan.reads, plan.pin("srv-status").c_str(), "status word"),
          torque_(plan.component, plan.reads, plan.pin("srv-torque-fb-pct").c_str(),
                  "actual torque", {.unit = "%"}),
          scale_(plan.component, plan.reads, plan.pin("srv-scale").c_str(),
                 "turns of one unit of the position", {.initial = 1.0}),
          velocity_scale_(plan.component, plan.reads, plan.pin("srv-vel-scale").c_str(),
                          "speed of one step of the target, of the drive", {.unit = "rpm"}),
          position_resolution_(plan.component, plan.reads, plan.pin("srv-pos-resolution").c_str(),
                               "steps of one turn, of the drive"),
          encoder_(plan, "enc", 32) {
        if (second_field_.present()) {
            second_scale_.emplace(plan.component, plan.reads, plan.pin("srv-scale-fb2").c_str(),
                                  "steps of one unit of the second position",
                                  hal::PinOptions<double>{.initial = 1.0});
            second_.emplace(plan, "enc-fb2", 32U);
        }
    }

    void read(const SlaveImage& image) noexcept override {
        read_units(image);
        if (!image.operational) {
            fault_ = true;
            enabled_ = false;
            halted_ = false;
            return;
        }
        const auto status = static_cast<std::uint16_t>(status_field_.read(image));
        const unsigned ready = status >> 14;
        status_ = status;
        fault_ = (status & shut_off) != 0 || ready == 0;
        enabled_ = ready == in_operation;
        halted_ = (status & follows_command) == 0;
        torque_ = static_cast<double>(torque_field_.read_signed(image)) * 0.1;
        encoder_.update(position_field_.read(image), position_resolution_.get(),
                        1.0 / usable_scale(scale_));
        if (second_) {
            second_->update(second_field_.read(image), 1, 1.0 / usable_scale(*second_scale_));
        }
    }

    void write(const SlaveImage& image) noexcept override {
        control_field_.write(image, control());
        synchronised_ = !synchronised_;
        const double steps = velocity_scale_ > 0.0 ? 60.0 / velocity_scale_.get() : 0.0;
        target_field_.write_limited(image, command_ * usable_scale(scale_) * steps);
    }
    void restart() noexcept override {
        for (ObjectRequest* const object : {&resolution_, &weight_, &exponent_}) {
            object->restart();
        }
    }

private:
    // master control word (S-0-0134) and drive status word (S-0-0135)
    static constexpr std::uint16_t synchronisation = 1U << 10;
    static constexpr std::uint16_t not_halted = 1U << 13;
    static constexpr std::uint16_t enable_drive = 1U << 14;
    static constexpr std::uint16_t drive_on = 1U << 15;
    static constexpr std::uint16_t follows_command = 1U << 3;
    static constexpr std::uint16_t shut_off = 1U << 13;
    static constexpr unsigned in_operation = 3;

    static ObjectRequest idn(const ChannelPlan& plan, std::uint16_t number, unsigned bits,
                             bool is_signed) {
        const auto drive = static_cast<std::uint8_t>(plan.channel.setting("drive", 0));
        return {number, drive, bits, is_signed, ObjectRequest::Protocol::soe};
    }
    void read_units(const SlaveImage& image) noexcept {
        for (ObjectRequest* const object : {&resolution_, &weight_, &exponent_}) {
            object->step(image);
        }
        if (resolution_.known()) {
            position_resolution_ = static_cast<std::uint32_t>(resolution_.value());
        }
        if (weight_.known() && exponent_.known()) {
            velocity_scale_ = static_cast<double>(weight_.value()) *
                              std::pow(10.0, static_cast<double>(exponent_.value()));
        }
    }
    std::uint16_t control() const noexcept {
        unsigned word = synchronised_ ? synchronisation : 0U;
        if (enable_) {
            word |= enable_drive;
            word |= halt_ ? 0U : not_halted;
            word |= off_ ? 0U : drive_on;
        }
        return static_cast<std::uint16_t>(word);
    }

    ImageField status_field_, control_field_, target_field_, position_field_, torque_field_;
    ImageField second_field_;
    ObjectRequest resolution_, weight_, exponent_;
    In<bool> enable_;
    Out<bool> enabled_, halted_, fault_;
    In<bool> halt_, off_;
    In<double> command_;
    Out<std::uint32_t> status_;
    Out<double> torque_;
    Param<double> scale_;
    Out<double> velocity_scale_;
    Out<std::uint32_t> position_resolution_;
    PositionEncoder encoder_;
    std::optional<Param<double>> second_scale_;
    std::optional<PositionEncoder> second_;
    bool synchronised_ = false;
};

}  // namespace hal::ethercat
