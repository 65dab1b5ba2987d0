// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Mult2 : hal::Component {
    using Component::Component;
    hal::In<double> in0{*this, "in0", "first factor"};
    hal::In<double> in1{*this, "in1", "second factor"};
    hal::Out<double> out{*this, "out", "in0 * in1"};
    hal::Function run{*this, "", hal::step<&Mult2::update>, "computes out"};

    void update(hal::Cycle) noexcept { out = in0 * in1; }
};

}  // namespace

HAL_COMPONENT(Mult2, "mult2", "Product of two values", R"(
`out = in0 * in1`

    loadrt mult2 names=feed
    addf feed servo
    net feed-programmed => feed.in0
    net feed-override   => feed.in1
    net feed            <= feed.out
)")
