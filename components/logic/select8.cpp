// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Select8 : hal::Component {
    using Component::Component;
    hal::In<std::int32_t> sel{*this, "sel",
                              "number of the output to set, 0..7; other values set none"};
    hal::Outs<bool> out{*this, "out#", 8, "TRUE while sel is #"};
    hal::In<bool> enable{*this, "enable", "FALSE sets all outputs to FALSE", {.initial = true}};
    hal::Function run{*this, "", hal::step<&Select8::update>, "sets one output"};

    void update(hal::Cycle) noexcept {
        const std::int32_t chosen = enable ? sel.get() : -1;
        for (std::size_t i = 0; i < out.size(); ++i) {
            out[i] = chosen == static_cast<std::int32_t>(i);
        }
    }
};

}  // namespace

HAL_COMPONENT(Select8, "select8", "Sets one of eight outputs", R"(
While `enable` is TRUE and `sel` is in 0..7, output `sel` is TRUE. All others are FALSE.

    loadrt select8 names=gear-lamp
    addf gear-lamp servo
    net gear       => gear-lamp.sel
    net lamp-low   <= gear-lamp.out1
    net lamp-high  <= gear-lamp.out2
)")
