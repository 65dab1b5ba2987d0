// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Demux : hal::Component {
    using Component::Component;
    hal::Argument          count{*this, "personality", 32, "how many outputs", {.min = 1, .max = 32}};
    hal::Ins<bool>         sel_bit{*this, "sel-bit-##", 5, "bit # of the choice"};
    hal::In<std::uint32_t> sel{*this, "sel-u32", "added to the number made of the bits"};
    hal::Outs<bool>        out{*this, "out-##", count, "TRUE while # is chosen; as a bar, while more than # is"};
    hal::Param<bool>       bargraph{*this, "bargraph", "TRUE: as many outputs are TRUE as the choice says"};
    hal::Function          run{*this, "", hal::step<&Demux::update>, "sets the outputs"};

    void update(hal::Cycle) noexcept {
        std::uint64_t chosen = sel;
        for (std::size_t i = 0; i < sel_bit.size(); ++i) chosen += sel_bit[i] ? std::uint64_t{1} << i : 0;
        const bool bar = bargraph;
        const std::uint64_t one = std::min<std::uint64_t>(chosen, out.size() - 1);
        for (std::size_t i = 0; i < out.size(); ++i) out[i] = bar ? i < chosen : i == one;
    }
};

}  // namespace

HAL_COMPONENT(Demux, "demux", "Makes one of several outputs TRUE, or a bar of them", R"(
The choice is `sel-u32` plus the number made of the `sel-bit` inputs; mostly one of the two is used. That output is TRUE, of a choice
beyond the last output the last one. With `bargraph` the choice is the length of the bar: 0 is none, 3 are the first three. `personality` is
the number of outputs.

In LinuxCNC the last output of a bar is never TRUE; here it is, for a choice of that many or more.

    # a bar of four lamps
    loadrt demux names=load-bar personality=4
    addf load-bar servo
    setp load-bar.bargraph TRUE
    net load-level => load-bar.sel-u32
    net lamp-0     <= load-bar.out-00
    net lamp-1     <= load-bar.out-01
    net lamp-2     <= load-bar.out-02
    net lamp-3     <= load-bar.out-03
)")
