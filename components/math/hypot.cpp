// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Hypot : hal::Component {
    using Component::Component;
    hal::In<double> in0{*this, "in0", "first component"};
    hal::In<double> in1{*this, "in1", "second component"};
    hal::In<double> in2{*this, "in2", "third component"};
    hal::Out<double> out{*this, "out", "length of the vector (in0, in1, in2)"};
    hal::Function run{*this, "", hal::step<&Hypot::update>, "computes out"};

    void update(hal::Cycle) noexcept { out = std::hypot(in0, in1, in2); }
};

}  // namespace

HAL_COMPONENT(Hypot, "hypot", "Length of a vector of up to three components", R"(
`out = sqrt(in0^2 + in1^2 + in2^2)`, without intermediate overflow. Leave unused inputs at 0.

    loadrt hypot names=path-speed
    addf path-speed servo
    net x-velocity => path-speed.in0
    net y-velocity => path-speed.in1
    net path-speed <= path-speed.out
)")
