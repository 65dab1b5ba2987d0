// SPDX-License-Identifier: MIT
#include "conv.hpp"
#include "hal/retained.hpp"

namespace {

struct Mux16 : hal::Component {
    using Component::Component;
    hal::In<bool> gray{*this, "use-graycode", "TRUE: the sel inputs are Gray code"};
    hal::In<bool> keep{
        *this, "suppress-no-input",
        "TRUE holds the outputs while all sel inputs are FALSE; in00 cannot be selected"};
    hal::In<double> debounce_time{
        *this, "debounce-time", "time from a new selection until it is in use", {.unit = "s"}};
    hal::Ins<bool> sel{*this, "sel#", 4, "bit # of the selection"};
    hal::Out<double> out_f{*this, "out-f", "selected input"};
    hal::Out<std::int32_t> out_s{*this, "out-s",
                                 "selected input, truncated and limited to the range of s32"};
    hal::Ins<double> in{*this, "in##", 16, "input for selection #"};
    hal::Out<double> elapsed{
        *this, "elapsed", "time for which the newest selection has been debounced", {.unit = "s"}};
    hal::Out<std::int32_t> selected{*this, "selected", "selection, decoded"};
    hal::Function run{*this, "", hal::step<&Mux16::update>, "computes the outputs"};

    void update(hal::Cycle cycle) noexcept {
        unsigned bits = 0;
        for (std::size_t i = sel.size(); i-- > 0;) {
            bits = bits << 1 | (sel[i] ? 1u : 0u);
        }
        if (keep && bits == 0) return;
        const unsigned choice = gray ? bits ^ bits >> 1 ^ bits >> 2 ^ bits >> 3 : bits;
        selected = static_cast<std::int32_t>(choice);
        if (debounce_time != 0.0 && choice != debounced_) {
            if (waited_s_ < debounce_time) {
                waited_s_ += cycle.seconds();
                elapsed = waited_s_;
                return;
            }
            debounced_ = choice;
            waited_s_ = 0.0;
        }
        const double value = in[choice];
        out_f = value;
        out_s = conv::convert<std::int32_t>(value, true);
    }

private:
    unsigned debounced_ = 0;  // the selection in use while debounce-time is set
    double waited_s_ = 0.0;   // for which another one was selected
    hal::Retained retained_{*this, {{"debounced", debounced_}, {"waited-s", waited_s_}}};
};

}  // namespace

HAL_COMPONENT(Mux16, "mux16", "Selects one of sixteen values, with Gray code and debouncing", R"(
The selection is the number `sel3 sel2 sel1 sel0`, in binary or in Gray code, in which adjacent
positions of a switch differ in one bit. A new selection is in use after it was seen for
`debounce-time`; until then the outputs are held. The time does not begin again when the selection
changes back or to another one, so a contact that bounces for longer passes.

**Differences from LinuxCNC:** `out-s` is limited to its range and 0 for NaN (LinuxCNC: what the
processor's conversion gives, on x86 -2147483648).

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
