// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Or2 : hal::Component {
    using Component::Component;
    hal::In<bool> in0{*this, "in0", "first input"};
    hal::In<bool> in1{*this, "in1", "second input"};
    hal::Out<bool> out{*this, "out", "TRUE while at least one input is TRUE"};
    hal::Function run{*this, "", hal::step<&Or2::update>, "computes out"};

    void update(hal::Cycle) noexcept { out = in0 | in1; }
};

}  // namespace

HAL_COMPONENT(Or2, "or2", "Two-input OR gate", R"(
`out = in0 OR in1`

    loadrt or2 names=any-fault
    addf any-fault servo
    net drive-fault  => any-fault.in0
    net bus-fault    => any-fault.in1
    net any-fault    <= any-fault.out
)")
