// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Xor2 : hal::Component {
    using Component::Component;
    hal::In<bool> in0{*this, "in0", "first input"};
    hal::In<bool> in1{*this, "in1", "second input"};
    hal::Out<bool> out{*this, "out", "TRUE while the inputs differ"};
    hal::Function run{*this, "", hal::step<&Xor2::update>, "computes out"};

    void update(hal::Cycle) noexcept { out = in0 != in1; }
};

}  // namespace

HAL_COMPONENT(Xor2, "xor2", "Two-input exclusive-OR gate", R"(
`out = in0 XOR in1`: TRUE while exactly one input is TRUE. With one input constant it passes or
inverts the other.

    loadrt xor2 names=channels-differ
    addf channels-differ servo
    net channel-a       => channels-differ.in0
    net channel-b       => channels-differ.in1
    net channels-differ <= channels-differ.out
)")
