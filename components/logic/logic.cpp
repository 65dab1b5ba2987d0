// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Logic : hal::Component {
    hal::Argument personality{
        *this,
        "personality",
        0x1f02,
        "number of inputs (1..16), plus 0x100 and, 0x200 or, 0x400 xor, 0x800 nand, 0x1000 nor",
        {.min = 0, .max = 0x1fff}};
    hal::Ins<bool> in{*this, "in-##", personality & 0xff, "input #"};
    hal::Outs<bool> all{*this, "and", has(0x100), "TRUE while every input is TRUE"};
    hal::Outs<bool> any{*this, "or", has(0x200), "TRUE while an input is TRUE"};
    hal::Outs<bool> odd{*this, "xor", has(0x400), "TRUE while an odd number of inputs is TRUE"};
    hal::Outs<bool> not_all{*this, "nand", has(0x800), "FALSE while every input is TRUE"};
    hal::Outs<bool> none{*this, "nor", has(0x1000), "FALSE while an input is TRUE"};
    hal::Function run{*this, "", hal::step<&Logic::update>, "computes the outputs"};

    explicit Logic(const hal_host* host) : Component(host) {
        if (in.size() < 1 || in.size() > 16) {
            throw hal::ArgumentError("personality",
                                     "personality=" + std::to_string(personality) + " has " +
                                         std::to_string(in.size()) +
                                         " inputs in its low byte; expected 1 to 16");
        }
    }

    void update(hal::Cycle) noexcept {
        std::size_t set = 0;
        for (const auto& pin : in) {
            set += pin ? 1 : 0;
        }
        const bool every = set == in.size();
        const bool one = set != 0;
        for (auto& pin : all) {
            pin = every;
        }
        for (auto& pin : any) {
            pin = one;
        }
        for (auto& pin : odd) {
            pin = set % 2 != 0;
        }
        for (auto& pin : not_all) {
            pin = !every;
        }
        for (auto& pin : none) {
            pin = !one;
        }
    }

private:
    std::int64_t has(std::int64_t bit) const { return (personality & bit) != 0 ? 1 : 0; }
};

}  // namespace

HAL_COMPONENT(Logic, "logic", "And, or, xor, nand, nor of up to 16 inputs", R"(
`personality` is the number of inputs plus a bit for each output:

| output | bit    | TRUE while                        |
| ------ | ------ | --------------------------------- |
| and    | 0x100  | every input is TRUE               |
| or     | 0x200  | an input is TRUE                  |
| xor    | 0x400  | an odd number of inputs is TRUE   |
| nand   | 0x800  | not every input is TRUE           |
| nor    | 0x1000 | no input is TRUE                  |

Without `personality` there are two inputs and all outputs.

    # an and of four inputs
    loadrt logic personality=0x104 names=ready
    addf ready servo
    net door-closed => ready.in-00
    net air-on      => ready.in-01
    net drives-on   => ready.in-02
    net no-fault    => ready.in-03
    net may-run     <= ready.and
)")
