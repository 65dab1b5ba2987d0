// SPDX-License-Identifier: MIT
#include "tristate.hpp"

using TristateBit = Tristate<bool>;

HAL_COMPONENT(TristateBit, "tristate_bit", "Writes a bit to a shared signal while enabled", R"(
Several instances may write to one signal; the one that runs last in a cycle takes precedence. While
none is enabled the signal keeps its value.

    loadrt tristate_bit names=from-pendant,from-panel
    addf from-pendant servo
    addf from-panel servo
    net pendant-coolant => from-pendant.in
    net pendant-active  => from-pendant.enable
    net panel-coolant   => from-panel.in
    net panel-active    => from-panel.enable
    net coolant <=> from-pendant.out <=> from-panel.out
)")
