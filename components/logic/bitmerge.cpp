// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Bitmerge : hal::Component {
    using Component::Component;
    hal::Argument count{*this,
                        "personality",
                        32,
                        "number of bits, from the least significant",
                        {.min = 1, .max = 32}};
    hal::Ins<bool> in{*this, "in-##", count, "bit # of out"};
    hal::Out<std::uint32_t> out{*this, "out", "word"};
    hal::Function run{*this, "", hal::step<&Bitmerge::update>, "merges the bits"};

    void update(hal::Cycle) noexcept {
        std::uint32_t word = 0;
        for (std::size_t i = in.size(); i-- > 0;) {
            word = word << 1 | (in[i] ? 1u : 0u);
        }
        out = word;
    }
};

}  // namespace

HAL_COMPONENT(Bitmerge, "bitmerge", "Merges bits into a word", R"(
`personality` is the number of bits with an input, 32 by default; bits without an input are 0.
`bitslice` is the inverse.

    loadrt bitmerge names=control personality=3
    addf control servo
    net drive-on    => control.in-00
    net drive-brake => control.in-01
    net drive-reset => control.in-02
    net drive-word  <= control.out
)")
