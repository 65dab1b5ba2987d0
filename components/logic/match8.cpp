// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Match8 : hal::Component {
    using Component::Component;
    hal::In<bool> in{*this,
                     "in",
                     "output of the previous match8 in a chain; FALSE sets out to FALSE",
                     {.initial = true}};
    hal::Ins<bool> a{*this, "a#", 8, "bit # of the first number"};
    hal::Ins<bool> b{*this, "b#", 8, "bit # of the second number"};
    hal::Out<bool> out{*this, "out", "TRUE while in is TRUE and both numbers are equal"};
    hal::Function run{*this, "", hal::step<&Match8::update>, "compares"};

    void update(hal::Cycle) noexcept {
        bool equal = in;
        for (std::size_t i = 0; i < a.size(); ++i) {
            equal &= a[i] == b[i];
        }
        out = equal;
    }
};

}  // namespace

HAL_COMPONENT(Match8, "match8", "Compares eight bits with eight others", R"(
`out` is TRUE while `in` is TRUE and `a0` = `b0` … `a7` = `b7`. For more bits, link `out` to the
`in` of another `match8`.

    # a code switch against a number set once
    loadrt match8 names=address
    addf address servo
    setp address.b0 TRUE
    setp address.b2 TRUE
    net switch-1  => address.a0
    net switch-2  => address.a1
    net switch-4  => address.a2
    net addressed <= address.out
)")
