// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Mux4 : hal::Component {
    using Component::Component;
    hal::In<bool> sel0{*this, "sel0", "low bit of the choice"};
    hal::In<bool> sel1{*this, "sel1", "high bit of the choice"};
    hal::In<double> in0{*this, "in0", "goes to out while sel1 sel0 are FALSE FALSE"};
    hal::In<double> in1{*this, "in1", "goes to out while sel1 sel0 are FALSE TRUE"};
    hal::In<double> in2{*this, "in2", "goes to out while sel1 sel0 are TRUE FALSE"};
    hal::In<double> in3{*this, "in3", "goes to out while sel1 sel0 are TRUE TRUE"};
    hal::Out<double> out{*this, "out", "selected input"};
    hal::Function run{*this, "", hal::step<&Mux4::update>, "computes out"};

    void update(hal::Cycle) noexcept {
        const hal::In<double>& low = sel0 ? in1 : in0;
        const hal::In<double>& high = sel0 ? in3 : in2;
        out = sel1 ? high : low;
    }
};

}  // namespace

HAL_COMPONENT(Mux4, "mux4", "Selects one of four values", R"(
| sel1  | sel0  | out |
| ----- | ----- | --- |
| FALSE | FALSE | in0 |
| FALSE | TRUE  | in1 |
| TRUE  | FALSE | in2 |
| TRUE  | TRUE  | in3 |

    loadrt mux4 names=jog-speed
    addf jog-speed servo
    setp jog-speed.in1 0.1
    setp jog-speed.in2 1
    setp jog-speed.in3 10
    net knob-a    => jog-speed.sel0
    net knob-b    => jog-speed.sel1
    net jog-speed <= jog-speed.out
)")
