// SPDX-License-Identifier: MIT
#include "abs_integer.hpp"

using AbsS64 = AbsInteger<std::int64_t>;

HAL_COMPONENT(AbsS64, "abs_s64", "Absolute value and sign of a 64-bit integer", R"(
For -2^63, whose absolute value is out of range, `out` is 2^63 - 1.

    loadrt abs_s64 names=distance
    addf distance servo
    net counts         => distance.in
    net counts-to-go   <= distance.out
    net going-backward <= distance.is-negative
)")
