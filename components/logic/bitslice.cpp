// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Bitslice : hal::Component {
    using Component::Component;
    hal::Argument personality{*this,
                              "personality",
                              32,
                              "number of bits, from the least significant",
                              {.min = 1, .max = 32}};
    hal::In<std::uint32_t> in{*this, "in", "word"};
    hal::Outs<bool> out{*this, "out-##", personality, "bit # of in"};
    hal::Function run{*this, "", hal::step<&Bitslice::update>, "splits the word"};

    void update(hal::Cycle) noexcept {
        std::uint32_t rest = in;
        for (auto& bit : out) {
            bit = (rest & 1u) != 0;
            rest >>= 1;
        }
    }
};

}  // namespace

HAL_COMPONENT(Bitslice, "bitslice", "Splits a word into bits", R"(
`personality` is the number of bits with an output, 32 by default. `bitmerge` is the inverse.

    loadrt bitslice names=status personality=4
    addf status servo
    net drive-status  => status.in
    net drive-ready   <= status.out-00
    net drive-enabled <= status.out-01
    net drive-fault   <= status.out-03
)")
