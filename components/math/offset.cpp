// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Offset : hal::Component {
    using Component::Component;
    hal::In<double> offset{*this, "offset", "the offset"};
    hal::In<double> in{*this, "in", "the input"};
    hal::Out<double> out{*this, "out", "in + offset"};
    hal::In<double> feedback_in{*this, "fb-in", "feedback, including the offset"};
    hal::Out<double> feedback_out{*this, "fb-out", "fb-in - offset"};
    hal::Function forward{*this, "update-output", hal::step<&Offset::update_output>,
                          "adds the offset to the input"};
    hal::Function backward{*this, "update-feedback", hal::step<&Offset::update_feedback>,
                           "subtracts the offset from the feedback"};

    void update_output(hal::Cycle) noexcept { out = in + offset; }
    void update_feedback(hal::Cycle) noexcept { feedback_out = feedback_in - offset; }
};

}  // namespace

HAL_COMPONENT(Offset, "offset", "Adds an offset to a command and subtracts it from the feedback",
              R"(
`out = in + offset` and `fb-out = fb-in - offset`, in two functions, so that a loop is shifted
without affecting the planner: run `update-feedback` before the controller and `update-output` after
the planner.

    loadrt offset names=z-shift
    addf z-shift.update-feedback servo
    addf z-shift.update-output   servo
    net z-offset   => z-shift.offset
    net z-planned  => z-shift.in
    net z-command  <= z-shift.out
    net z-measured => z-shift.fb-in
    net z-feedback <= z-shift.fb-out
)")
