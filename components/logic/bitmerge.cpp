// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Bitmerge : hal::Component {
    using Component::Component;
    hal::Argument           count{*this, "personality", 32, "how many bits, from the lowest", {.min = 1, .max = 32}};
    hal::Ins<bool>          in{*this, "in-##", count, "bit # of out"};
    hal::Out<std::uint32_t> out{*this, "out", "the word"};
    hal::Function           run{*this, "", hal::step<&Bitmerge::update>, "puts the word together"};

    void update(hal::Cycle) noexcept {
        std::uint32_t word = 0;
        for (std::size_t i = in.size(); i-- > 0;) word = word << 1 | (in[i] ? 1u : 0u);
        out = word;
    }
};

}  // namespace

HAL_COMPONENT(Bitmerge, "bitmerge", "Puts bits together into a word", R"(
`personality` says how many bits have an input; without it all 32 have, and bits without an input are 0. `bitslice` is
the way back.

    loadrt bitmerge names=control personality=3
    addf control servo
    net drive-on    => control.in-00
    net drive-brake => control.in-01
    net drive-reset => control.in-02
    net drive-word  <= control.out
)")
