// SPDX-License-Identifier: MIT
// The start-up of one slave: INIT, PRE-OP, SAFE-OP, OP.
#include <algorithm>

#include "ethercat/master/bus.hpp"

namespace hal::ethercat::master {

namespace {

constexpr std::int64_t retry_after_ns = 1'000 * millisecond;

constexpr std::uint16_t code(State state) noexcept { return static_cast<std::uint16_t>(state); }

/// Returns whether the slave has reached the state that it is to stay in, and notes it as settled.
bool settle(Bus& bus, Device& d, State reached) noexcept {
    if (reached != bus.target(d)) return false;
    d.settled = bus.config(d) != nullptr;
    bus.set_in_op(d, d.settled && reached == State::op);
    return true;
}

// The transitions of the start-up. Each returns false when a step failed.

/// To INIT, whatever the state, without the settings of an earlier start-up.
Task<bool> enter_init(Channel& c, Bus& bus, Device& d) noexcept {
    bool ok = co_await request_state(c, bus, d, State::init, d.slave.timeouts.to_init);
    if (!ok) co_return false;
    bus.note_in_op(d, false);
    ok = co_await clear_settings(c, bus, d);
    if (!ok) co_return false;
    ok = co_await startup_writes(c, bus, d, State::preop);
    co_return ok;
}

/// INIT to `state`, PRE-OP or BOOT, with the mailbox of that state.
Task<bool> enter_mailbox_state(Channel& c, Bus& bus, Device& d, State state) noexcept {
    d.slave.boot_mailbox = state == State::boot;
    bool ok = co_await set_mailbox(c, bus, d);
    if (!ok) co_return false;
    ok = co_await request_state(c, bus, d, state, d.slave.timeouts.to_preop);
    co_return ok;
}

/// In PRE-OP: what the slave exchanges.
Task<bool> configure_in_preop(Channel& c, Bus& bus, Device& d) noexcept {
    bool ok = co_await startup_writes(c, bus, d, State::safeop);
    if (!ok) co_return false;
    ok = co_await map_process_data(c, bus, d);
    co_return ok;
}

/// PRE-OP to SAFE-OP, with clock, process data and SYNC signals.
Task<bool> enter_safeop(Channel& c, Bus& bus, Device& d) noexcept {
    bool ok = co_await synchronise(c, bus, d);
    if (!ok) co_return false;
    ok = co_await set_process_data(c, bus, d);
    if (!ok) co_return false;
    ok = co_await start_sync_signals(c, bus, d);
    if (!ok) co_return false;
    ok = co_await request_state(c, bus, d, State::safeop, d.slave.timeouts.to_safeop_op);
    if (!ok) co_return false;
    const auto configured = static_cast<std::size_t>(d.slave.configured);
    const auto& image = bus.image.slave(configured);
    bus.image.set_counting(configured, image.writes, image.reads, false);
    co_return true;
}

/// SAFE-OP to OP, once valid outputs reach the slave and its SYNC signals have begun.
Task<bool> enter_op(Channel& c, Bus& bus, Device& d) noexcept {
    bool ok = co_await startup_writes(c, bus, d, State::op);
    if (!ok) co_return false;
    for (unsigned cycles = 0; cycles < 3 || !bus.outputs_valid; ++cycles) {
        co_await c.sleep(0);
    }
    if (d.sync_begins_ns > c.now_ns()) {
        co_await c.sleep_until(d.sync_begins_ns + bus.setup.cycle_ns);
    }
    // a clock may have jumped while the slave waited for its SYNC signals
    ok = co_await synchronise(c, bus, d);
    if (!ok) co_return false;
    report_tolerated_clock(bus, d);
    bus.note_in_op(d, true);
    ok = co_await request_state(c, bus, d, State::op, d.slave.timeouts.to_safeop_op);
    co_return ok;
}

/// Takes the slave from any state to the one that it is to stay in. A slave that is not in the
/// setup stays in PRE-OP or BOOT, for tools. Returns false when a step failed.
Task<bool> bring_up(Channel& c, Bus& bus, Device& d) noexcept {
    bool ok = co_await enter_init(c, bus, d);
    if (!ok) co_return false;
    if (settle(bus, d, State::init)) co_return true;
    const State mailbox_state = d.to_boot ? State::boot : State::preop;
    ok = co_await enter_mailbox_state(c, bus, d, mailbox_state);
    if (!ok) co_return false;
    if (d.to_boot || bus.config(d) == nullptr) co_return true;
    ok = co_await configure_in_preop(c, bus, d);
    if (!ok) co_return false;
    if (settle(bus, d, State::preop)) co_return true;

    ok = co_await enter_safeop(c, bus, d);
    if (!ok) co_return false;
    if (settle(bus, d, State::safeop)) co_return true;

    ok = co_await enter_op(c, bus, d);
    if (!ok) co_return false;
    co_return settle(bus, d, State::op);
}

}  // namespace

Task<bool> read_state(Channel& c, Bus&, Device& d) noexcept {
    const Answer a = co_await read(c, d.slave, registers::al_status, 6);
    if (!a.arrived || a.wkc != 1) co_return false;
    const auto status = get<std::uint16_t>(c.data());
    d.slave.state = d.status.state = static_cast<State>(status & 0x0f);
    d.slave.al_failed = d.status.al_error = (status & al_error) != 0;
    d.slave.al_code = d.status.al_code =
        d.slave.al_failed ? get<std::uint16_t>(c.data() + 4) : std::uint16_t{0};
    co_return true;
}

Task<bool> request_state(Channel& c, Bus& bus, Device& d, State state,
                         std::uint32_t timeout_ms) noexcept {
    bool answers = co_await read_state(c, bus, d);
    if (answers && d.slave.state == state && !d.slave.al_failed) co_return true;
    // A request for INIT acknowledges whatever went before; other requests start from a state
    // without error.
    const auto control = static_cast<std::uint16_t>(
        code(state) | (state == State::init || d.slave.al_failed ? al_error : 0));
    const Answer a = co_await write(c, d.slave, registers::al_control, control);
    if (!answers || a.wkc != 1) co_return false;
    const std::int64_t until = c.now_ns() + timeout_ms * millisecond;
    unsigned silent = 0;
    while (c.now_ns() < until && silent < 3) {
        answers = co_await read_state(c, bus, d);
        silent = answers ? 0 : silent + 1;
        if (!answers) continue;
        if (d.slave.al_failed) {
            bus.report(Event::state_refused, d, code(state), d.slave.al_code);
            const auto acknowledge = static_cast<std::uint16_t>(code(d.slave.state) | al_error);
            co_await write(c, d.slave, registers::al_control, acknowledge);
            co_return false;
        }
        if (d.slave.state == state) {
            bus.report(Event::state_reached, d, code(state));
            co_return true;
        }
    }
    if (silent < 3) {
        bus.report(Event::state_timeout, d, code(state), code(d.slave.state));
    }
    co_return false;
}

Task<void> boot(Channel& c, Bus& bus, Device& d) noexcept {
    d.began_ns = c.now_ns();
    while (true) {
        bus.unsettle(d);
        const bool ok = co_await bring_up(c, bus, d);
        if (ok) break;
        const bool here = co_await read_state(c, bus, d);
        if (!here) {
            bus.suspicious = true;  // the supervision decides whether it is lost
            bus.leave(d);
            bus.report(Event::slave_lost, d, d.slave.position);
            ++d.status.losses;
            co_return;
        }
        co_await clear_process_data(c, bus, d);  // it must neither count nor take outputs
        ++d.attempts;
        const std::int64_t pause = retry_after_ns * std::min(d.attempts, 10U);
        bus.report(Event::start_up_failed, d, code(d.slave.state), pause / (1000 * millisecond));
        co_await c.sleep(pause);
    }
    d.attempts = 0;
    if (!d.settled) co_return;
    const std::int64_t took_ms = (c.now_ns() - d.began_ns) / millisecond;
    if (d.in_op) {
        bus.report(Event::slave_operational, d, d.slave.position, took_ms);
    } else {
        bus.report(Event::slave_settled, d, code(d.slave.state), took_ms);
    }
}

}  // namespace hal::ethercat::master
