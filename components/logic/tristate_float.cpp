// SPDX-License-Identifier: MIT
#include "tristate.hpp"

using TristateFloat = Tristate<double>;

HAL_COMPONENT(TristateFloat, "tristate_float", "Writes a number to a shared signal while enabled",
              R"(
Several instances may write to one signal; the one that runs last in a cycle takes precedence. While
none is enabled the signal keeps its value.

    loadrt tristate_float names=from-pendant,from-panel
    addf from-pendant servo
    addf from-panel servo
    net pendant-speed  => from-pendant.in
    net pendant-active => from-pendant.enable
    net panel-speed    => from-panel.in
    net panel-active   => from-panel.enable
    net speed <=> from-pendant.out <=> from-panel.out
)")
