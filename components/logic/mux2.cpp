// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Mux2 : hal::Component {
    using Component::Component;
    hal::In<bool> sel{*this, "sel", "selects the input"};
    hal::In<double> in[2]{{*this, "in0", "input for sel FALSE"},
                          {*this, "in1", "input for sel TRUE"}};
    hal::Out<double> out{*this, "out", "selected input"};
    hal::Function run{*this, "", hal::step<&Mux2::update>, "computes out"};

    // by index: a branch would be mispredicted
    void update(hal::Cycle) noexcept { out = in[sel].get(); }
};

}  // namespace

HAL_COMPONENT(Mux2, "mux2", "Selects one of two values", R"(
`out = sel ? in1 : in0`

    loadrt mux2 names=speed
    addf speed servo
    setp speed.in0 10
    setp speed.in1 2.5
    net door-open  => speed.sel
    net speed-cmd  <= speed.out
)")
