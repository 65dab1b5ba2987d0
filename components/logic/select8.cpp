// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Select8 : hal::Component {
    using Component::Component;
    hal::In<std::int32_t> sel{*this, "sel", "which output is TRUE; none below 0 and above 7"};
    hal::Outs<bool>       out{*this, "out#", 8, "TRUE while sel is #"};
    hal::In<bool>         enable{*this, "enable", "FALSE: all outputs are FALSE", {.initial = true}};
    hal::Function         run{*this, "", hal::step<&Select8::update>, "sets one output"};

    void update(hal::Cycle) noexcept {
        const std::int32_t chosen = enable ? sel.get() : -1;
        for (std::size_t i = 0; i < out.size(); ++i) out[i] = chosen == static_cast<std::int32_t>(i);
    }
};

}  // namespace

HAL_COMPONENT(Select8, "select8", "Makes one of eight outputs TRUE", R"(
While `enable` is TRUE and `sel` is from 0 to 7, output number `sel` is TRUE. All others are FALSE.

    loadrt select8 names=gear-lamp
    addf gear-lamp servo
    net gear       => gear-lamp.sel
    net lamp-low   <= gear-lamp.out1
    net lamp-high  <= gear-lamp.out2
)")
