// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct TristateBit : hal::Component {
    using Component::Component;
    hal::In<bool> in{*this, "in", "the value to place"};
    hal::Io<bool> out{*this, "out", "takes in while enable is TRUE; left alone otherwise"};
    hal::In<bool> enable{*this, "enable", "TRUE: in goes to out"};
    hal::Function run{*this, "", hal::step<&TristateBit::update>, "places the value"};

    void update(hal::Cycle) noexcept {
        if (enable) out = in.get();
    }
};

}  // namespace

HAL_COMPONENT(TristateBit, "tristate_bit", "Places a bit on a shared signal while enabled", R"(
Several of them may write to one signal; the one that runs last in a cycle wins. While no one is enabled the signal keeps
its value.

    loadrt tristate_bit names=from-pendant,from-panel
    addf from-pendant servo
    addf from-panel servo
    net pendant-coolant => from-pendant.in
    net pendant-active  => from-pendant.enable
    net panel-coolant   => from-panel.in
    net panel-active    => from-panel.enable
    net coolant <=> from-pendant.out <=> from-panel.out
)")
