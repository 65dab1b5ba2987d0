// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Mux8 : hal::Component {
    using Component::Component;
    hal::Ins<bool> sel{*this, "sel#", 3, "bit # of the selection"};
    hal::Out<double> out{*this, "out", "selected input"};
    hal::Ins<double> in{*this, "in#", 8, "input for selection #"};
    hal::Function run{*this, "", hal::step<&Mux8::update>, "computes out"};

    void update(hal::Cycle) noexcept {
        const unsigned selected = unsigned{sel[2]} << 2 | unsigned{sel[1]} << 1 | unsigned{sel[0]};
        out = in[selected].get();
    }
};

}  // namespace

HAL_COMPONENT(Mux8, "mux8", "Selects one of eight values", R"(
The selection is the binary number `sel2 sel1 sel0`: with `sel2` and `sel0` TRUE and `sel1` FALSE,
`out` is `in5`.

    loadrt mux8 names=feed-steps
    addf feed-steps servo
    setp feed-steps.in1 0.5
    setp feed-steps.in2 1
    setp feed-steps.in3 1.2
    net switch-1      => feed-steps.sel0
    net switch-2      => feed-steps.sel1
    net feed-override <= feed-steps.out
)")
