// SPDX-License-Identifier: MIT
#include "routed.hpp"

namespace {

struct DemuxGeneric : hal::Component {
    using Component::Component;
    hal::InstanceName name{*this, "demux-gen", 2};
    hal::TextArgument text{*this,
                           "config",
                           "ff4",
                           "type in, type out (b f s u) and number of outputs, for each instance",
                           {.per_instance = true}};
    routed::Config config{text.get()};
    routed::Choice choice{*this, config};
    routed::AnyType<hal::Ins> in{*this, config.from, "in-", "", 1, "value"};
    routed::AnyType<hal::Outs> out{*this, config.to,   "out-",
                                   "-##", config.ways, "set to the value while # is selected"};
    hal::Function run{*this, "", hal::step<&DemuxGeneric::update>, "updates the selected output"};

    void update(hal::Cycle cycle) noexcept {
        const std::uint64_t way = choice.update(cycle);
        if (way == choice.ways) return;
        in.visit([&](const auto& from) {
            out.visit([&](auto& to) { routed::copy(from[0], to[way]); });
        });
    }
};

}  // namespace

HAL_COMPONENT(DemuxGeneric, "demux_generic", "Routes a value of any type to one of many outputs",
              R"(
The inverse of `mux_generic`, with the same `config=`, selection, debouncing and type conversion.
The selected output follows the input; the others keep their values, initially 0. `config=fu12`
creates `demux-gen.00` with a float input and twelve u32 outputs.

    loadrt demux_generic config=ss3 names=to-axis
    addf to-axis servo
    net wheel-counts => to-axis.in-s32
    net axis-number  => to-axis.sel-int
    net x-counts     <= to-axis.out-s32-00
    net y-counts     <= to-axis.out-s32-01
    net z-counts     <= to-axis.out-s32-02
)")
