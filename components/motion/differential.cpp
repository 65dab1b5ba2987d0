// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Differential : hal::Component {
    using Component::Component;
    hal::In<double> roll_cmd{*this, "roll-cmd", "commanded roll", {.unit = "deg"}};
    hal::In<double> pitch_cmd{*this, "pitch-cmd", "commanded pitch", {.unit = "deg"}};
    hal::Out<double> roll_fb{*this, "roll-fb", "roll, from the motor positions", {.unit = "deg"}};
    hal::Out<double> pitch_fb{
        *this, "pitch-fb", "pitch, from the motor positions", {.unit = "deg"}};
    hal::Out<double> motor0_cmd{
        *this, "motor0-cmd", "commanded position of motor 0", {.unit = "deg"}};
    hal::Out<double> motor1_cmd{
        *this, "motor1-cmd", "commanded position of motor 1", {.unit = "deg"}};
    hal::In<double> motor0_fb{*this, "motor0-fb", "position of motor 0", {.unit = "deg"}};
    hal::In<double> motor1_fb{*this, "motor1-fb", "position of motor 1", {.unit = "deg"}};
    hal::Function run{*this, "", &Differential::update, "computes commands and feedback"};

    void update(hal::Cycle) noexcept {
        roll_fb = 0.5 * (motor0_fb + motor1_fb);
        pitch_fb = 0.5 * (motor0_fb - motor1_fb);
        motor0_cmd = roll_cmd + pitch_cmd;
        motor1_cmd = roll_cmd - pitch_cmd;
    }
};

}  // namespace

HAL_COMPONENT(Differential, "differential", "Kinematics of a differential transmission", R"(
    motor0-cmd = roll-cmd + pitch-cmd      roll-fb  = (motor0-fb + motor1-fb) / 2
    motor1-cmd = roll-cmd - pitch-cmd      pitch-fb = (motor0-fb - motor1-fb) / 2

Both motors in the same direction: roll; in opposite directions: pitch.

    loadrt differential names=wrist
    addf wrist servo
    net roll  => wrist.roll-cmd
    net pitch => wrist.pitch-cmd
    net left  <= wrist.motor0-cmd
    net right <= wrist.motor1-cmd
)")
