// SPDX-License-Identifier: MIT
#include "hal/component.hpp"
#include "hal/retained.hpp"

namespace {

struct Edge : hal::Component {
    using Component::Component;
    hal::In<bool> in{*this, "in", "the input"};
    hal::Out<bool> out{*this, "out", "TRUE during the pulse after an edge"};
    hal::Out<bool> out_invert{*this, "out-invert", "inverse of out"};
    hal::Param<bool> both{*this, "both", "TRUE detects both edges, regardless of in-edge"};
    hal::Param<bool> in_edge{
        *this, "in-edge", "edge to detect: TRUE is falling, FALSE is rising", {.initial = true}};
    hal::Param<std::int32_t> width_ns{
        *this, "out-width-ns", "duration of the output pulse; 0 is one cycle", {.unit = "ns"}};
    hal::Out<std::int32_t> time_left_ns{
        *this, "time-left-ns", "remaining time of the output pulse", {.unit = "ns"}};
    hal::Out<bool> last_in{*this, "last-in", "input of the previous cycle"};
    hal::Function run{*this, "", hal::step<&Edge::update>, "detects edges"};

    void update(hal::Cycle cycle) noexcept {
        const bool now = in;
        const bool changed = started_ && now != was_in_;
        if (changed && (both || now != in_edge)) {
            left_ns_ = std::max(width_ns.get(), 0);
            pulse_ = true;
        } else if (pulse_) {
            left_ns_ = std::max<std::int64_t>(left_ns_ - cycle.period_ns(), 0);
            pulse_ = left_ns_ > 0;
        }
        out = pulse_;
        out_invert = !pulse_;
        time_left_ns = static_cast<std::int32_t>(left_ns_);
        last_in = now;
        was_in_ = now;
        started_ = true;
    }

private:
    std::int64_t left_ns_ = 0;
    bool started_ = false;
    bool was_in_ = false;
    bool pulse_ = false;
    hal::Retained retained_{
        *this,
        {{"left-ns", left_ns_}, {"started", started_}, {"was-in", was_in_}, {"pulse", pulse_}}};
};

}  // namespace

HAL_COMPONENT(Edge, "edge", "Turns an edge into a pulse", R"(
`out` becomes TRUE in the cycle of the edge, for `out-width-ns` rounded up to whole cycles, at least
one; another edge during the pulse restarts it. An input that is TRUE from the start is not an edge.
The default, `in-edge` TRUE, is the *falling* edge.

    loadrt edge names=button-down
    addf button-down servo
    setp button-down.in-edge FALSE
    net button      => button-down.in
    net button-down <= button-down.out
)")
