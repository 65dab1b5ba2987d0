// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct And2 : hal::Component {
    using Component::Component;
    hal::In<bool> in0{*this, "in0", "first input"};
    hal::In<bool> in1{*this, "in1", "second input"};
    hal::Out<bool> out{*this, "out", "TRUE while both inputs are TRUE"};
    hal::Function run{*this, "", hal::step<&And2::update>, "computes out"};

    void update(hal::Cycle) noexcept { out = in0 & in1; }
};

}  // namespace

HAL_COMPONENT(And2, "and2", "Two-input AND gate", R"(
`out = in0 AND in1`

    loadrt and2 names=run-allowed
    addf run-allowed servo
    net door-closed  => run-allowed.in0
    net power-good   => run-allowed.in1
    net run-allowed  <= run-allowed.out
)")
