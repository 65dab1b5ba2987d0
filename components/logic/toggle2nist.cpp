// SPDX-License-Identifier: MIT
#include "nist.hpp"

using Toggle2nist = nist::Button<true>;

HAL_COMPONENT(Toggle2nist, "toggle2nist", "A toggle button for a device with on, off and is-on", R"(
Each change of `in`, in either direction, asks the device for its other state: `on` is TRUE until `is-on` is, or `off` is
TRUE until `is-on` is FALSE. A device that does not answer within `max-pulse-length` cycles has the request taken back.

LinuxCNC's manual page of version 2.9 says that rising edges count; what the component does there is this. For a button that
is TRUE while it is pressed use `momentary2nist`.

    loadrt toggle2nist names=power
    addf power servo
    net power-switch     => power.in
    net machine-is-on    => power.is-on
    net machine-turn-on  <= power.on
    net machine-turn-off <= power.off
)")
