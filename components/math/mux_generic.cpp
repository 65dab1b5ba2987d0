// SPDX-License-Identifier: MIT
#include "routed.hpp"

namespace {

struct MuxGeneric : hal::Component {
    using Component::Component;
    hal::InstanceName           name{*this, "mux-gen", 2};
    hal::TextArgument           text{*this, "config", "ff4", "type in, type out (b f s u) and number of inputs, for each mux",
                                     {.per_instance = true}};
    routed::Config              config{text.get()};
    routed::Choice              choice{*this, config};
    routed::AnyType<hal::Ins>   in{*this, config.from, "in-", "-##", config.ways, "goes to the output while # is chosen"};
    routed::AnyType<hal::Outs>  out{*this, config.to, "out-", "", 1, "the chosen input"};
    hal::Function               run{*this, "", hal::step<&MuxGeneric::update>, "computes the output"};

    void update(hal::Cycle cycle) noexcept {
        const std::uint64_t way = choice.update(cycle);
        if (way == choice.ways) return;
        in.visit([&](const auto& from) { out.visit([&](auto& to) { routed::copy(from[way], to[0]); }); });
    }
};

}  // namespace

HAL_COMPONENT(MuxGeneric, "mux_generic", "Selects one of many values of any type", R"(
`config=bb8,fu12` makes `mux-gen.00`, which selects one of eight bits, and `mux-gen.01`, which selects one of twelve floats and gives a
u32. The letters are b bit, f float, s s32, u u32; first the type in, then the type out.

The choice is `sel-int` plus the number made of the `sel-bit` inputs, which are there when the number of inputs is a power of
two. A choice beyond the last input is the last one. A new choice must hold for `debounce-us`; until then the output follows the last one.

A value that the type of the output does not have is cut to an integer and limited to the range of the type. A float is
FALSE within 2e-7 of 0. What is not a number gives 0.

    loadrt mux_generic config=sf3 names=tool-speed
    addf tool-speed servo
    setp tool-speed.in-s32-00 3000
    setp tool-speed.in-s32-01 12000
    setp tool-speed.in-s32-02 18000
    net tool-class    => tool-speed.sel-int
    net spindle-limit <= tool-speed.out-float
)")
