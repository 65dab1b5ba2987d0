// SPDX-License-Identifier: MIT
#include "conv.hpp"

namespace {

struct Mux16 : hal::Component {
    using Component::Component;
    hal::In<bool>          gray{*this, "use-graycode", "TRUE: the sel inputs are Gray code"};
    hal::In<bool>          keep{*this, "suppress-no-input", "TRUE holds the outputs while all sel inputs are FALSE; in00 cannot be selected"};
    hal::In<double>        debounce_time{*this, "debounce-time", "time for which a new selection must be stable", {.unit = "s"}};
    hal::Ins<bool>         sel{*this, "sel#", 4, "bit # of the selection"};
    hal::Out<double>       out_f{*this, "out-f", "selected input"};
    hal::Out<std::int32_t> out_s{*this, "out-s", "selected input, truncated and limited to the range of s32"};
    hal::Ins<double>       in{*this, "in##", 16, "input for selection #"};
    hal::Out<double>       elapsed{*this, "elapsed", "time for which the selection has been stable", {.unit = "s"}};
    hal::Out<std::int32_t> selected{*this, "selected", "selection, decoded"};
    hal::Function          run{*this, "", hal::step<&Mux16::update>, "computes the outputs"};

    void update(hal::Cycle cycle) noexcept {
        unsigned bits = 0;
        for (std::size_t i = sel.size(); i-- > 0;) bits = bits << 1 | (sel[i] ? 1u : 0u);
        held_ns_ = bits == bits_ ? held_ns_ + (held_ns_ < (std::int64_t{1} << 62) ? cycle.period_ns() : 0) : 0;
        bits_ = bits;
        elapsed = static_cast<double>(held_ns_) / 1e9;
        const unsigned choice = gray ? bits ^ bits >> 1 ^ bits >> 2 ^ bits >> 3 : bits;
        selected = static_cast<std::int32_t>(choice);
        if (keep && bits == 0) return;
        if (!(elapsed < debounce_time)) chosen_ = choice;
        if (chosen_ == none) return;
        const double value = in[chosen_];
        out_f = value;
        out_s = conv::convert<std::int32_t>(value, true);
    }

private:
    static constexpr unsigned none = 16;
    std::int64_t held_ns_ = 0;
    unsigned bits_ = 0, chosen_ = none;
};

}  // namespace

HAL_COMPONENT(Mux16, "mux16", "Selects one of sixteen values, with Gray code and debouncing", R"(
The selection is the number `sel3 sel2 sel1 sel0`, in binary or in Gray code, in which adjacent positions of a switch differ
in one bit. A new selection must be stable for `debounce-time`; until then the previous one is in use. (In LinuxCNC a contact that
bounces for longer passes.)
`out-s` is 0 while the value is NaN.

    loadrt mux16 names=override
    addf override servo
    setp override.use-graycode TRUE
    setp override.suppress-no-input TRUE
    setp override.debounce-time 0.2
    setp override.in01 0.1
    setp override.in02 0.2
    setp override.in03 0.5
    setp override.in04 1.0
    net switch-a      => override.sel0
    net switch-b      => override.sel1
    net switch-c      => override.sel2
    net feed-override <= override.out-f
)")
