// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Not : hal::Component {
    using Component::Component;
    hal::In<bool> in{*this, "in", "the input"};
    hal::Out<bool> out{*this, "out", "the input, inverted"};
    hal::Function run{*this, "", hal::step<&Not::update>, "computes out"};

    void update(hal::Cycle) noexcept { out = !in; }
};

}  // namespace

HAL_COMPONENT(Not, "not", "Inverter", R"(
`out = NOT in`

    loadrt not names=released
    addf released servo
    net pressed  => released.in
    net released <= released.out
)")
