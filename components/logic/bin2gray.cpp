// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Bin2gray : hal::Component {
    using Component::Component;
    hal::In<std::uint32_t> in{*this, "in", "binary number"};
    hal::Out<std::uint32_t> out{*this, "out", "Gray code of the number"};
    hal::Function run{*this, "", hal::step<&Bin2gray::update>, "converts"};

    void update(hal::Cycle) noexcept { out = in ^ in >> 1; }
};

}  // namespace

HAL_COMPONENT(Bin2gray, "bin2gray", "Number to Gray code", R"(
In Gray code, adjacent numbers differ in one bit.

    loadrt bin2gray names=to-gray
    addf to-gray servo
    net tool-number => to-gray.in
    net tool-code   <= to-gray.out
)")
