// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct TristateFloat : hal::Component {
    using Component::Component;
    hal::In<double> in{*this, "in", "the value to place"};
    hal::Io<double> out{*this, "out", "takes in while enable is TRUE; left alone otherwise"};
    hal::In<bool>   enable{*this, "enable", "TRUE: in goes to out"};
    hal::Function   run{*this, "", hal::step<&TristateFloat::update>, "places the value"};

    void update(hal::Cycle) noexcept {
        if (enable) out = in.get();
    }
};

}  // namespace

HAL_COMPONENT(TristateFloat, "tristate_float", "Places a number on a shared signal while enabled", R"(
Several of them may write to one signal; the one that runs last in a cycle wins. While no one is enabled the signal keeps
its value.

    loadrt tristate_float names=from-pendant,from-panel
    addf from-pendant servo
    addf from-panel servo
    net pendant-speed  => from-pendant.in
    net pendant-active => from-pendant.enable
    net panel-speed    => from-panel.in
    net panel-active   => from-panel.enable
    net speed <=> from-pendant.out <=> from-panel.out
)")
