// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct EstopLatch : hal::Component {
    using Component::Component;

    hal::In<bool> ok_in{*this, "ok-in", "TRUE while everything before this latch is well", {.initial = true}};
    hal::In<bool> fault_in{*this, "fault-in", "TRUE is a fault"};
    hal::In<bool> reset{*this, "reset", "rising edge: out of the faulted state, if nothing is wrong any more"};
    hal::Out<bool> ok_out{*this, "ok-out", "TRUE in the OK state", {.safe = false}};
    hal::Out<bool> fault_out{*this, "fault-out", "TRUE in the faulted state", {.initial = true, .safe = true}};
    hal::Out<bool> watchdog{*this, "watchdog", "changes in every cycle of the OK state"};

    hal::Function run{*this, "", &EstopLatch::update, "moves between the two states"};

    void update(hal::Cycle) noexcept {
        const bool pressed = reset && !was_reset_;
        was_reset_ = reset;
        const bool well = ok_in && !fault_in;
        const bool ok = well && (ok_out || pressed);
        ok_out = ok;
        fault_out = !ok;
        if (ok) watchdog = !watchdog;
    }

private:
    bool was_reset_ = false;
};

}  // namespace

HAL_COMPONENT(EstopLatch, "estop_latch", "A link of the emergency-stop chain: remembers a fault until it is reset", R"(
Two states, "faulted" at the start and "OK". To OK: `ok-in` TRUE, `fault-in` FALSE and a rising edge on `reset`. Back to
faulted: `ok-in` FALSE or `fault-in` TRUE, in the same cycle. In the OK state `watchdog` changes every cycle, for a `watchdog`
or a charge pump that trips when this function stops running. Links are chained `ok-out` to `ok-in`.

    loadrt estop_latch
    addf estop-latch.0 servo-thread
    net button  => estop-latch.0.ok-in
    net chain   <= estop-latch.0.ok-out
)")
