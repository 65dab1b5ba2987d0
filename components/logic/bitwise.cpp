// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Bitwise : hal::Component {
    using Component::Component;
    hal::In<std::uint32_t> in0{*this, "in0", "first word"};
    hal::In<std::uint32_t> in1{*this, "in1", "second word"};
    hal::Out<std::uint32_t> out_and{*this, "out-and", "bits set in both words"};
    hal::Out<std::uint32_t> out_or{*this, "out-or", "bits set in at least one word"};
    hal::Out<std::uint32_t> out_xor{*this, "out-xor", "bits in which the words differ"};
    hal::Out<std::uint32_t> out_nand{*this, "out-nand", "out-and, inverted"};
    hal::Out<std::uint32_t> out_nor{*this, "out-nor", "out-or, inverted"};
    hal::Out<std::uint32_t> out_xnor{*this, "out-xnor", "out-xor, inverted"};
    hal::Function run{*this, "", hal::step<&Bitwise::update>, "computes all outputs"};

    void update(hal::Cycle) noexcept {
        const std::uint32_t a = in0;
        const std::uint32_t b = in1;
        out_and = a & b;
        out_or = a | b;
        out_xor = a ^ b;
        out_nand = ~(a & b);
        out_nor = ~(a | b);
        out_xnor = ~(a ^ b);
    }
};

}  // namespace

HAL_COMPONENT(Bitwise, "bitwise", "Bitwise AND, OR, XOR, NAND, NOR and XNOR of two words", R"(
    # the faults that count, out of a drive's status word
    loadrt bitwise names=drive-faults
    addf drive-faults servo
    setp drive-faults.in1 0x88
    net drive-status => drive-faults.in0
    net drive-fault  <= drive-faults.out-and
)")
