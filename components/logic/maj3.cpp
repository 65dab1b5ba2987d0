// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Maj3 : hal::Component {
    using Component::Component;
    hal::In<bool> in1{*this, "in1", "first voter"};
    hal::In<bool> in2{*this, "in2", "second voter"};
    hal::In<bool> in3{*this, "in3", "third voter"};
    hal::Out<bool> out{*this, "out", "value of at least two inputs"};
    hal::Param<bool> invert{*this, "invert", "TRUE inverts out"};
    hal::Function run{*this, "", hal::step<&Maj3::update>, "counts the votes"};

    void update(hal::Cycle) noexcept {
        const int votes = in1 + in2 + in3;
        out = (votes >= 2) != invert;
    }
};

}  // namespace

HAL_COMPONENT(Maj3, "maj3", "Majority of three inputs", R"(
`out` is TRUE while two or three inputs are TRUE; with `invert`, while none or one is TRUE.

    loadrt maj3 names=door
    addf door servo
    net door-switch-1 => door.in1
    net door-switch-2 => door.in2
    net door-switch-3 => door.in3
    net door-closed   <= door.out
)")
