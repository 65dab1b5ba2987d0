// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Offset : hal::Component {
    using Component::Component;
    hal::In<double>  offset{*this, "offset", "the offset"};
    hal::In<double>  in{*this, "in", "the input"};
    hal::Out<double> out{*this, "out", "in + offset"};
    hal::In<double>  feedback_in{*this, "fb-in", "the feedback, with the offset in it"};
    hal::Out<double> feedback_out{*this, "fb-out", "fb-in - offset"};
    hal::Function    forward{*this, "update-output", hal::step<&Offset::update_output>, "adds the offset to the input"};
    hal::Function    backward{*this, "update-feedback", hal::step<&Offset::update_feedback>, "takes the offset out of the feedback"};

    void update_output(hal::Cycle) noexcept { out = in + offset; }
    void update_feedback(hal::Cycle) noexcept { feedback_out = feedback_in - offset; }
};

}  // namespace

HAL_COMPONENT(Offset, "offset", "Adds an offset to a command and takes it out of the feedback", R"(
`out = in + offset` and `fb-out = fb-in - offset`, in two functions, so that a loop can be shifted without the planner
noticing: run `update-feedback` before the controller and `update-output` after the planner.

    loadrt offset names=z-shift
    addf z-shift.update-feedback servo
    addf z-shift.update-output   servo
    net z-offset   => z-shift.offset
    net z-planned  => z-shift.in
    net z-command  <= z-shift.out
    net z-measured => z-shift.fb-in
    net z-feedback <= z-shift.fb-out
)")
