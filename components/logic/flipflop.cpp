// SPDX-License-Identifier: MIT
#include "hal/component.hpp"
#include "hal/edge.hpp"
#include "hal/retained.hpp"

namespace {

struct Flipflop : hal::Component {
    using Component::Component;
    hal::In<bool> data{*this, "data", "copied to out at a rising edge of clk"};
    hal::In<bool> clk{*this, "clk", "a rising edge writes data to out"};
    hal::In<bool> set{*this, "set", "TRUE sets out to TRUE"};
    hal::In<bool> reset{*this, "reset", "TRUE sets out to FALSE; overrides set"};
    hal::Io<bool> out{*this, "out", "stored bit"};
    hal::Io<bool> out_not{*this, "out-not", "stored bit, inverted"};
    hal::Function run{*this, "", hal::step<&Flipflop::update>, "stores the bit"};

    void update(hal::Cycle) noexcept {
        bool stored = out;
        if (clock_edge_.rises(clk)) {
            stored = data;
        }
        if (set) {
            stored = true;
        }
        if (reset) {
            stored = false;
        }
        out = stored;
        out_not = !stored;
    }

private:
    hal::RisingEdge clock_edge_;
    hal::Retained retained_{*this, {{"was-clk", clock_edge_}}};
};

}  // namespace

HAL_COMPONENT(Flipflop, "flipflop", "D flip-flop with set and reset", R"(
`reset` overrides `set`, and both override `clk`; a `clk` that is TRUE in the first cycle is an
edge. The bit is stored in `out` itself, which is an input/output pin, so another writer on the same
signal can change it.

    # remember a short alarm until the operator acknowledges it
    loadrt flipflop names=alarm-memory
    addf alarm-memory servo
    net alarm       => alarm-memory.set
    net acknowledge => alarm-memory.reset
    net alarm-lamp  <= alarm-memory.out
)")
