// SPDX-License-Identifier: MIT
#include <cstdint>

#include "hal/component.hpp"
#include "hal/edge.hpp"
#include "hal/retained.hpp"

namespace {

/// Values of the public pin `reason`: never renumber them.
enum Reason : std::uint32_t { none = 0, not_reset = 1, chain_open = 2, fault = 3 };

struct EstopLatch : hal::Component {
    using Component::Component;

    hal::In<bool> ok_in{
        *this, "ok-in", "TRUE while the chain before this latch is OK", {.initial = true}};
    hal::In<bool> fault_in{*this, "fault-in", "TRUE trips the latch"};
    hal::In<bool> reset{
        *this, "reset",
        "a rising edge leaves the faulted state, if ok-in is TRUE and fault-in FALSE"};
    hal::Out<bool> ok_out{*this, "ok-out", "TRUE in the OK state", {.safe = false}};
    hal::Out<bool> fault_out{
        *this, "fault-out", "TRUE in the faulted state", {.initial = true, .safe = true}};
    hal::Out<std::uint32_t> reason{
        *this, "reason", "reason why ok-out is FALSE: see the table", {.initial = not_reset}};
    hal::Out<bool> watchdog{*this, "watchdog", "toggles in every cycle of the OK state"};

    hal::Function run{*this, "", &EstopLatch::update, "updates the state"};

    void update(hal::Cycle) noexcept {
        const bool pressed = reset_edge_.rises(reset);
        const bool healthy = ok_in && !fault_in;
        const bool ok = healthy && (ok_out || pressed);
        ok_out = ok;
        fault_out = !ok;
        if (ok) {
            watchdog = !watchdog;
            reason = none;
        } else if (pressed || reason == none || reason == not_reset) {
            reason = present_reason();
        }
    }

private:
    Reason present_reason() const noexcept {
        if (!ok_in) return chain_open;
        return fault_in ? fault : not_reset;
    }

    hal::RisingEdge reset_edge_;
    hal::Retained retained_{*this, {{"was-reset", reset_edge_}}};
};

}  // namespace

HAL_COMPONENT(EstopLatch, "estop_latch", "Emergency stop latch: holds a fault until it is reset",
              R"(
The latch has two states: "faulted" (initial) and "OK". A rising edge of `reset` with `ok-in` TRUE
and `fault-in` FALSE enters OK. `ok-in` FALSE or `fault-in` TRUE enters faulted in the same cycle.
In the OK state `watchdog` toggles every cycle, for a `watchdog` or a charge pump that trips when
this function stops running. As in LinuxCNC, a `reset` that is TRUE in the first cycle counts as a
rising edge; the other safety components need a FALSE first. Chain latches by linking `ok-out` to
the next `ok-in`.

`reason` keeps the first cause until the latch is OK again. A rising edge of `reset` that does not help sets it to the present cause.

| reason | |
| --- | --- |
| 0 | OK |
| 1 | not reset since the start; both inputs are good |
| 2 | ok-in was FALSE: the chain before this latch is open |
| 3 | fault-in was TRUE |

    loadrt estop_latch
    addf estop-latch.0 servo-thread
    net button  => estop-latch.0.ok-in
    net chain   <= estop-latch.0.ok-out
)")
