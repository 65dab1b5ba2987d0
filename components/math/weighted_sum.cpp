// SPDX-License-Identifier: MIT
#include "hal/naming.hpp"

namespace {

struct WeightedSum : hal::Component {
    hal::InstanceName name{*this, "wsum"};
    hal::WholeFunctionNames whole{*this};
    hal::Argument size{*this,
                       "wsum_sizes",
                       8,
                       "number of bits, for each sum",
                       {.per_instance = true, .min = 1, .max = 32}};
    hal::Ins<bool> bit{*this, "bit.#.in", size, "TRUE adds the weight of bit #"};
    hal::Ios<std::int32_t> weight{*this, "bit.#.weight", size, "weight of bit #; initially 2^#"};
    hal::In<bool> hold{*this, "hold", "TRUE holds the sum"};
    hal::Out<std::int32_t> sum{*this, "sum", "sum"};
    hal::Io<std::int32_t> offset{*this, "offset", "constant added to the sum"};
    hal::Function run{*this,
                      "process_wsums",
                      hal::step<&WeightedSum::update>,
                      "computes all sums",
                      {.shared = true}};

    explicit WeightedSum(const hal_host* host) : Component(host) {
        std::uint32_t power = 1;
        for (auto& w : weight) {
            w = static_cast<std::int32_t>(power);
            power *= 2;
        }
    }

    void update(hal::Cycle) noexcept {
        if (hold) return;
        auto total = static_cast<std::uint32_t>(offset.get());
        for (std::size_t i = 0; i < bit.size(); ++i) {
            total += bit[i] ? static_cast<std::uint32_t>(weight[i].get()) : 0;
        }
        sum = static_cast<std::int32_t>(total);
    }
};

}  // namespace

HAL_COMPONENT(WeightedSum, "weighted_sum", "Number from weighted bits", R"(
`sum` is `offset` plus the weights of all bits that are TRUE; `hold` holds it. The weights are
initially 1, 2, 4 …, so that the bits are a binary number. `wsum_sizes=3,8` creates `wsum.0` with
three bits and `wsum.1` with eight; one function, `process_wsums`, computes all sums. A sum wraps
around at the limits of its type. LinuxCNC supports up to 8 sums of 16 bits; in Halcyon a sum has up
to 32 bits.

    # a switch of four positions, coded with two contacts, as tool numbers from 10 on
    loadrt weighted_sum names=tool wsum_sizes=2
    addf process_wsums servo
    setp tool.offset 10
    net contact-1   => tool.bit.0.in
    net contact-2   => tool.bit.1.in
    net tool-number <= tool.sum
)")
