// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Lut5 : hal::Component {
    using Component::Component;
    hal::Ins<bool>            in{*this, "in-#", 5, "bit # of the row of the table"};
    hal::Out<bool>            out{*this, "out", "the table's entry for the inputs"};
    hal::Param<std::uint32_t> function{*this, "function", "the table: bit n is the output for row n"};
    hal::Function             run{*this, "", hal::step<&Lut5::update>, "looks up the output"};

    void update(hal::Cycle) noexcept {
        std::uint32_t row = 0;
        for (std::size_t i = in.size(); i-- > 0;) row = row << 1 | (in[i] ? 1u : 0u);
        out = (function >> row & 1u) != 0;
    }
};

}  // namespace

HAL_COMPONENT(Lut5, "lut5", "Any logic function of five inputs, from a table", R"(
`in-4` to `in-0` read as a binary number are a row from 0 to 31; `out` is that bit of `function`. To find `function`, add
up 2^row of all rows in which `out` shall be TRUE. Inputs that are not used stay FALSE.

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
