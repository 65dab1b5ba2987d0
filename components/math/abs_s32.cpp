// SPDX-License-Identifier: MIT
#include "abs_integer.hpp"

using AbsS32 = AbsInteger<std::int32_t>;

HAL_COMPONENT(AbsS32, "abs_s32", "Absolute value and sign of a 32-bit integer", R"(
For -2^31, whose absolute value is out of range, `out` is 2^31 - 1.

    loadrt abs_s32 names=distance
    addf distance servo
    net counts         => distance.in
    net counts-to-go   <= distance.out
    net going-backward <= distance.is-negative
)")
