// SPDX-License-Identifier: MIT
// The state machine of an emulated slave (ETG.1000.6, clause 6.4.1) and its checks.
#include "ethercat/devices/firmware.hpp"
#include "ethercat/wire/registers.hpp"

namespace hal::ethercat::devices {
namespace {

// for valid outputs and SYNC0 after OP was requested
constexpr std::int64_t op_timeout_ns = 200'000'000;
constexpr std::int64_t lost_pulses = 10;

int rank(State s) noexcept {
    if (s == State::op) return 4;
    if (s == State::safeop) return 3;
    if (s == State::preop) return 2;
    if (s == State::boot) return 1;
    return 0;
}

}  // namespace

void Firmware::take_control(esc::Pdi& pdi, std::uint16_t control) noexcept {
    const auto to = static_cast<State>(control & 0x0f);
    const bool acknowledge = (control & al_error) != 0;
    // an error is acknowledged first
    if (error_ && !acknowledge && rank(to) > rank(state_)) return;
    if (acknowledge) {
        error_ = false;
    }
    if ((control & al_identify) != 0 && to == state_ && !error_) {
        pdi.set_al_status(static_cast<std::uint16_t>(static_cast<unsigned>(state_) | al_identify),
                          design_.device_id);
        return;
    }
    target_ = to;
    const auto delay = faults_.state_delay_ns.load(std::memory_order_relaxed);
    if (delay > 0 && to != state_) {
        change_at_ns_ = now_ns_ + delay;
        return;
    }
    change_at_ns_ = -1;
    change(pdi, to);
}

void Firmware::change(esc::Pdi& pdi, State to) noexcept {
    op_since_ns_ = -1;
    const bool known = to == State::init || to == State::preop || to == State::boot ||
                       to == State::safeop || to == State::op;
    if (!known) return fail(pdi, state_, 0x0012);
    const bool up = rank(to) > rank(state_);
    const bool valid = to == state_ || to == State::init ||
                       (to == State::boot && state_ == State::init) ||
                       (state_ != State::boot && (!up                   ? to != State::boot
                                                  : to == State::boot   ? false
                                                  : to == State::preop  ? state_ == State::init
                                                  : to == State::safeop ? state_ == State::preop
                                                                        : state_ == State::safeop));
    if (!valid) return fail(pdi, state_, 0x0011);
    if (to == state_) {
        return error_ ? void() : pdi.set_al_status(static_cast<std::uint16_t>(state_), 0);
    }
    if (const auto code = faults_.reject[to].load(std::memory_order_relaxed)) {
        return fail(pdi, state_, code);
    }
    if (const auto code = up ? code_against(pdi, to) : std::uint16_t{0}) {
        return fail(pdi, state_, code);
    }
    if (to == State::op) {
        op_since_ns_ = now_ns_;
        return wait_for_op(pdi);
    }
    enter(pdi, to);
}

std::uint16_t Firmware::code_against(esc::Pdi& pdi, State to) noexcept {
    switch (to) {
    case State::boot:
        return design_.sii.boot.receive.size == 0 ? std::uint16_t{0x0013}
                                                  : check_mailbox(pdi, design_.sii.boot, 0x0015);
    case State::preop:
        return design_.sii.has_mailbox() ? check_mailbox(pdi, design_.sii.mailboxes, 0x0016)
                                         : std::uint16_t{0};
    case State::safeop:
        if (const auto code = check_process_data(pdi)) return code;
        return check_sync(pdi);
    default: return 0;
    }
}

std::uint16_t Firmware::check_mailbox(esc::Pdi& pdi, const sii::Mailboxes& m,
                                      std::uint16_t code) const noexcept {
    const auto out = pdi.sync_manager(0);
    const auto in = pdi.sync_manager(1);
    const auto fits = [](const esc::Pdi::SyncManager& sm, const sii::Area& area,
                         unsigned direction) {
        return sm.enabled && sm.start == area.start && sm.length >= smallest_mailbox &&
               sm.length <= area.size && (sm.control & 0x0fU) == (2U | direction);
    };
    return fits(out, m.receive, 4) && fits(in, m.send, 0) ? std::uint16_t{0} : code;
}

std::uint16_t Firmware::check_process_data(esc::Pdi& pdi) noexcept {
    outputs_.build();
    inputs_.build();
    const auto fits = [&](unsigned number, std::uint16_t start, std::size_t bytes,
                          unsigned direction) {
        const auto sm = pdi.sync_manager(number);
        if (bytes == 0) return !sm.enabled || sm.length == 0;
        return sm.enabled && sm.start == start && sm.length == bytes &&
               (sm.control & 0x0fU) == direction;
    };
    const bool has_out = out_start_ != 0;
    const bool has_in = in_start_ != 0;
    if (has_out && !fits(sm_out_, out_start_, outputs_.bytes(), 4)) return 0x001d;
    if (has_in && !fits(sm_in_, in_start_, inputs_.bytes(), 0)) return 0x001e;
    return 0;
}

std::uint16_t Firmware::check_sync(esc::Pdi& pdi) const noexcept {
    const std::uint8_t activation = *pdi.memory(registers::dc_activation);
    const bool requested = (activation & 1) != 0;
    if (!requested) {
        return design_.dc_required ? std::uint16_t{0x0027} : std::uint16_t{0};
    }
    if (!design_.dc) return 0x0028;
    if ((activation & 2) == 0) return 0x0030;
    const auto sync = pdi.sync();
    if (sync.sync0_cycle_ns == 0) return 0x0035;
    return sync.sync0_cycle_ns < design_.shortest_cycle_ns ? std::uint16_t{0x002e}
                                                           : std::uint16_t{0};
}

/// Completes SAFE-OP to OP once outputs were received and SYNC0 runs.
void Firmware::wait_for_op(esc::Pdi& pdi) noexcept {
    if (op_since_ns_ < 0 || state_ != State::safeop) return;
    const bool outputs = outputs_.bytes() == 0 || received_;
    const auto sync = pdi.sync();
    const bool synchronised = !sync.active || sync.pulses != 0;
    if (outputs && synchronised) {
        op_since_ns_ = -1;
        enter(pdi, State::op);
    } else if (now_ns_ - op_since_ns_ >= op_timeout_ns) {
        op_since_ns_ = -1;
        fail(pdi, State::safeop, synchronised ? 0x001b : 0x002d);
    }
}

/// Leaves OP when outputs or SYNC0 fail.
void Firmware::watch(esc::Pdi& pdi) noexcept {
    if (const auto code = faults_.fail.exchange(0, std::memory_order_relaxed)) {
        return fail(pdi, State::safeop, code);
    }
    const bool watched = outputs_.bytes() != 0 && (pdi.sync_manager(sm_out_).control & 0x40) != 0;
    if (watched && pdi.watchdog_expired()) return fail(pdi, State::safeop, 0x001b);
    if (outputs_.bytes() != 0 && !pdi.sync_manager(sm_out_).enabled) {
        return fail(pdi, State::safeop, 0x001d);
    }
    const auto sync = pdi.sync();
    if (sync.active && sync.last_pulse_ns != 0 &&
        now_ns_ - sync.last_pulse_ns > lost_pulses * sync.sync0_cycle_ns) {
        fail(pdi, State::safeop, 0x002c);
    }
}

void Firmware::enter(esc::Pdi& pdi, State to) noexcept {
    const bool leaves_op = state_ == State::op && to != State::op;
    if (leaves_op) {
        outputs_.clear();
    }
    if (to == State::init) {
        mailbox_running_ = false;
    }
    if (to == State::boot) {
        start_mailbox(design_.sii.boot);
    }
    if (to == State::preop && state_ == State::init && design_.sii.has_mailbox()) {
        start_mailbox(design_.sii.mailboxes);
    }
    if (to == State::safeop && state_ == State::preop) {
        const auto sync = pdi.sync();
        received_ = false;
        last_step_ns_ = now_ns_;
        pulses_ = sync.active ? sync.pulses : 0;
        state_ = to;
        step(pdi, 0, false);  // inputs are valid in SAFE-OP
    }
    state_ = to;
    if (to != State::op) {
        received_ = received_ && to == State::safeop;
    }
    shown_.store(to, std::memory_order_relaxed);
    if (leaves_op) {
        step(pdi, 0, false);  // below SAFE-OP it is the last one: outputs are off
    }
    pdi.set_al_status(static_cast<std::uint16_t>(to), 0);
}

void Firmware::fail(esc::Pdi& pdi, State stay, std::uint16_t code) noexcept {
    if (stay != state_) {
        const bool leaves_op = state_ == State::op;
        if (leaves_op) {
            outputs_.clear();
            received_ = false;
        }
        state_ = stay;
        shown_.store(stay, std::memory_order_relaxed);
        if (leaves_op) {
            step(pdi, 0, false);
        }
    }
    error_ = true;
    pdi.set_al_status(static_cast<std::uint16_t>(static_cast<unsigned>(stay) | al_error), code);
}

}  // namespace hal::ethercat::devices
