// SPDX-License-Identifier: MIT
#include "hal/component.hpp"
#include "hal/retained.hpp"

namespace {

struct Reset : hal::Component {
    using Component::Component;
    hal::In<bool> trigger{*this, "trigger", "an edge writes the values"};
    hal::Io<std::uint32_t> out_u32{*this, "out-u32",
                                   "set to reset-u32 at an edge; not written otherwise"};
    hal::In<std::uint32_t> reset_u32{*this, "reset-u32", "value for out-u32"};
    hal::Io<std::int32_t> out_s32{*this, "out-s32",
                                  "set to reset-s32 at an edge; not written otherwise"};
    hal::In<std::int32_t> reset_s32{*this, "reset-s32", "value for out-s32"};
    hal::Io<double> out_float{*this, "out-float",
                              "set to reset-float at an edge; not written otherwise"};
    hal::In<double> reset_float{*this, "reset-float", "value for out-float"};
    hal::Io<bool> out_bit{*this, "out-bit", "set to reset-bit at an edge; not written otherwise"};
    hal::In<bool> reset_bit{*this, "reset-bit", "value for out-bit"};
    hal::Param<bool> rising{
        *this, "rising", "TRUE: rising edges of trigger write the values", {.initial = true}};
    hal::Param<bool> falling{*this, "falling", "TRUE: falling edges of trigger write the values"};
    hal::Function run{*this, "", hal::step<&Reset::update>, "detects edges and writes the values"};

    void update(hal::Cycle) noexcept {
        const bool now = trigger;
        const bool edge = now != was_ && (now ? rising : falling);
        was_ = now;
        if (!edge) return;
        out_u32 = reset_u32.get();
        out_s32 = reset_s32.get();
        out_float = reset_float.get();
        out_bit = reset_bit.get();
    }

private:
    bool was_ = false;
    hal::Retained retained_{*this, {{"was", was_}}};
};

}  // namespace

HAL_COMPONENT(Reset, "reset", "Writes values into signals at an edge", R"(
An edge of `trigger` writes each `reset-` input to the signal of its `out-` pin, which other
components may then change. Unlinked outputs have no effect.

    loadrt reset names=clear-override
    addf clear-override servo
    setp clear-override.reset-float 1
    net program-start => clear-override.trigger
    net feed-override <=> clear-override.out-float
)")
