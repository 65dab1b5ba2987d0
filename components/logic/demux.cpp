// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Demux : hal::Component {
    using Component::Component;
    hal::Argument count{*this, "personality", 32, "number of outputs", {.min = 1, .max = 32}};
    hal::Ins<bool> sel_bit{*this, "sel-bit-##", 5, "bit # of the selection"};
    hal::In<std::uint32_t> sel{*this, "sel-u32", "number added to that of the sel-bit pins"};
    hal::Outs<bool> out{*this, "out-##", count,
                        "TRUE while # is selected; with bargraph, while the selection is above #"};
    hal::Param<bool> bargraph{*this, "bargraph",
                              "TRUE: the selection is the number of outputs that are TRUE"};
    hal::Function run{*this, "", hal::step<&Demux::update>, "sets the outputs"};

    void update(hal::Cycle) noexcept {
        std::uint64_t chosen = sel;
        for (std::size_t i = 0; i < sel_bit.size(); ++i) {
            chosen += sel_bit[i] ? std::uint64_t{1} << i : 0;
        }
        const bool bar = bargraph;
        const std::uint64_t one = std::min<std::uint64_t>(chosen, out.size() - 1);
        for (std::size_t i = 0; i < out.size(); ++i) {
            out[i] = bar ? i < chosen : i == one;
        }
    }
};

}  // namespace

HAL_COMPONENT(Demux, "demux", "Sets one of several outputs, or the first N of them", R"(
The selection is `sel-u32` plus the binary number of the `sel-bit` inputs; usually only one of the
two is used. The selected output is TRUE; a selection above the last output selects the last one.
With `bargraph` the selection is the number of outputs that are TRUE: 0 sets none, 3 sets the first
three. `personality` is the number of outputs.

In LinuxCNC the last output of a bar is never TRUE; in Halcyon it is TRUE if the selection is at
least the number of outputs.

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
