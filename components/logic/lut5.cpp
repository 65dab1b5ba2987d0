// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Lut5 : hal::Component {
    using Component::Component;
    hal::Ins<bool> in{*this, "in-#", 5, "bit # of the row number"};
    hal::Out<bool> out{*this, "out", "entry of the table for the inputs"};
    hal::Param<std::uint32_t> function{*this, "function", "table: bit n is the output for row n"};
    hal::Function run{*this, "", hal::step<&Lut5::update>, "looks up the output"};

    void update(hal::Cycle) noexcept {
        std::uint32_t row = 0;
        for (std::size_t i = in.size(); i-- > 0;) {
            row = row << 1 | (in[i] ? 1u : 0u);
        }
        out = (function >> row & 1u) != 0;
    }
};

}  // namespace

HAL_COMPONENT(Lut5, "lut5", "Any logic function of five inputs, from a table", R"(
`in-4` to `in-0` are the binary number of a row, 0..31; `out` is that bit of `function`. `function`
is the sum of 2^row over all rows in which `out` is TRUE. Leave unused inputs unlinked.

| function   | is                          |
| ---------- | --------------------------- |
| 0x8        | in-0 and in-1               |
| 0xe        | in-0 or in-1                |
| 0x6        | in-0 xor in-1               |
| 0xca       | in-1 while in-2 is TRUE, otherwise in-0 |
| 0x80000000 | and of all five             |
| 0xfffffffe | or of all five              |

    # the spindle may turn with the door closed, or open while the key is set
    loadrt lut5 names=spindle-ok
    addf spindle-ok servo
    setp spindle-ok.function 0xe
    net door-closed => spindle-ok.in-0
    net setup-key   => spindle-ok.in-1
    net may-turn    <= spindle-ok.out
)")
