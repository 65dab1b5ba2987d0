// SPDX-License-Identifier: MIT
#include "nist.hpp"

using Momentary2nist = nist::Button<false>;

HAL_COMPONENT(Momentary2nist, "momentary2nist", "A push button for a device with on, off and is-on", R"(
Each press, a rising edge of `in`, asks the device for its other state: `on` is TRUE until `is-on` is, or `off` is TRUE
until `is-on` is FALSE. A device that does not answer within `max-pulse-length` cycles has the request taken back.

    loadrt momentary2nist names=power
    addf power servo
    net power-button     => power.in
    net machine-is-on    => power.is-on
    net machine-turn-on  <= power.on
    net machine-turn-off <= power.off
)")
