// SPDX-License-Identifier: MIT
#include "routed.hpp"

namespace {

struct MuxGeneric : hal::Component {
    using Component::Component;
    hal::InstanceName name{*this, "mux-gen", 2};
    hal::TextArgument text{*this,
                           "config",
                           "ff4",
                           "type in, type out (b f s u) and number of inputs, for each instance",
                           {.per_instance = true}};
    routed::Config config{text.get()};
    routed::Choice choice{*this, config};
    routed::AnyType<hal::Ins> in{*this, config.from, "in-",
                                 "-##", config.ways, "input for selection #"};
    routed::AnyType<hal::Outs> out{*this, config.to, "out-", "", 1, "selected input"};
    hal::Function run{*this, "", hal::step<&MuxGeneric::update>, "computes the output"};

    void update(hal::Cycle cycle) noexcept {
        const std::uint64_t way = choice.update(cycle);
        if (way == choice.ways) return;
        in.visit([&](const auto& from) {
            out.visit([&](auto& to) { routed::copy(from[way], to[0]); });
        });
    }
};

}  // namespace

HAL_COMPONENT(MuxGeneric, "mux_generic", "Selects one of many values of any type", R"(
`config=bb8,fu12` creates `mux-gen.00`, which selects one of eight bits, and `mux-gen.01`, which
selects one of twelve floats and converts it to u32. The letters are b (bit), f (float), s (s32) and
u (u32): first the type in, then the type out.

The selection is `sel-int` plus the binary number of the `sel-bit` inputs, which exist if the number
of inputs is a power of two or one more. A selection above the last input selects the last one; a
sum above 4294967295 counts as that (in LinuxCNC it wraps around). A new selection is in use after
`debounce-us`; until then the output is held. The time begins when the selection leaves `selected`
and ends when it is back, so a contact that bounces for longer passes.

A value is truncated to an integer and limited to the range of the output's type. As a bit, a float
is FALSE within 2e-7 of 0. NaN gives 0.

    loadrt mux_generic config=sf3 names=tool-speed
    addf tool-speed servo
    setp tool-speed.in-s32-00 3000
    setp tool-speed.in-s32-01 12000
    setp tool-speed.in-s32-02 18000
    net tool-class    => tool-speed.sel-int
    net spindle-limit <= tool-speed.out-float
)")
