// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Bitslice : hal::Component {
    using Component::Component;
    hal::Argument          personality{*this, "personality", 32, "how many bits, from the lowest", {.min = 1, .max = 32}};
    hal::In<std::uint32_t> in{*this, "in", "the word"};
    hal::Outs<bool>        out{*this, "out-##", personality, "bit # of in"};
    hal::Function          run{*this, "", hal::step<&Bitslice::update>, "takes the word apart"};

    void update(hal::Cycle) noexcept {
        std::uint32_t rest = in;
        for (auto& bit : out) {
            bit = (rest & 1u) != 0;
            rest >>= 1;
        }
    }
};

}  // namespace

HAL_COMPONENT(Bitslice, "bitslice", "Takes a word apart into bits", R"(
`personality` says how many bits have an output; without it all 32 have. `bitmerge` is the way back.

    loadrt bitslice names=status personality=4
    addf status servo
    net drive-status  => status.in
    net drive-ready   <= status.out-00
    net drive-enabled <= status.out-01
    net drive-fault   <= status.out-03
)")
