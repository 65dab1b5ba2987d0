// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Gray2bin : hal::Component {
    using Component::Component;
    hal::In<std::uint32_t> in{*this, "in", "Gray code"};
    hal::Out<std::uint32_t> out{*this, "out", "binary number"};
    hal::Function run{*this, "", hal::step<&Gray2bin::update>, "converts"};

    /// Each bit of the number is the parity of the code's bits from there up: a prefix sum in five
    /// doublings.
    void update(hal::Cycle) noexcept {
        std::uint32_t bits = in;
        for (const unsigned distance : {1u, 2u, 4u, 8u, 16u}) {
            bits ^= bits >> distance;
        }
        out = bits;
    }
};

}  // namespace

HAL_COMPONENT(Gray2bin, "gray2bin", "Gray code to number", R"(
For absolute encoders and code switches with a code whose adjacent positions differ in one bit.

    loadrt gray2bin names=from-gray
    addf from-gray servo
    net encoder-code  => from-gray.in
    net encoder-angle <= from-gray.out
)")
