// SPDX-License-Identifier: MIT
#include "fieldbus/scocan/station/mode_control.hpp"

namespace hal::scocan {

namespace {
/// Cycles from the request to the switch, and those in which the SYNCs announce it. The answers use
/// shared slots.
constexpr std::uint32_t change_cycles = 16;
constexpr std::uint32_t pending_cycles = 4;
}  // namespace

void ModeControl::forget() noexcept {
    unknown_ = false;
    armed_ = {};
    change_ = {};
}

bool ModeControl::request(std::uint32_t mode) noexcept {
    if (!core_.leading || change_.active || !core_.table.has_mode(mode) || mode == mode_) {
        return false;
    }
    change_ = {};
    change_.active = true;
    change_.mode = mode;
    change_.at = core_.clock.cycle() + change_cycles;
    change_.ready[core_.node] = true;
    core_.send_shared(
        encode(Request{core_.node, Request::What::prepare, static_cast<std::uint8_t>(mode),
                       core_.table.crc, static_cast<std::uint8_t>(core_.counter_of(change_.at))}),
        false);
    return true;
}

void ModeControl::prepare(const Request& r) noexcept {
    armed_ = {};
    if (r.what == Request::What::cancel || !core_.numbered) return;
    Answer answer{core_.node, r.mode, Answer::Reason::ready, core_.table.crc};
    if (core_.table.has_mode(r.mode)) {
        const auto ahead = (r.at_counter + counter_cycles - core_.counter) % counter_cycles;
        armed_ = {true, false, r.mode, core_.clock.cycle() + ahead};
    } else {
        answer.reason = Answer::Reason::unknown_mode;
    }
    core_.send_shared(encode(answer), true);
}

void ModeControl::answered(const Answer& a) noexcept {
    if (!change_.active || change_.agreed) return;
    if (a.node >= core_.table.nodes.size() || a.mode != change_.mode) return;
    if (a.reason != Answer::Reason::ready) return refuse(a.node, a.reason);
    change_.ready[a.node] = true;
}

/// Returns the first node that has not answered; no_node: none.
std::uint32_t ModeControl::first_missing() const noexcept {
    for (std::uint32_t i = 0; i < core_.table.nodes.size(); ++i) {
        if (!change_.ready[i]) return i;
    }
    return no_node;
}

void ModeControl::continue_change() noexcept {
    if (!change_.active) return;
    const std::uint64_t now = core_.clock.cycle();
    if (change_.agreed) {
        if (now >= change_.at) {
            change_ = {};
        }
        return;
    }
    if (now + pending_cycles < change_.at) return;
    const std::uint32_t missing = first_missing();
    if (missing != no_node) return refuse(missing, Answer::Reason::offline);
    change_.agreed = true;
    armed_ = {true, true, change_.mode, change_.at};
}

void ModeControl::refuse(std::uint32_t who, Answer::Reason reason) noexcept {
    core_.raise(Event::mode_refused, who, change_.mode, static_cast<Time>(reason));
    core_.send_shared(encode(Request{core_.node, Request::What::cancel,
                                     static_cast<std::uint8_t>(change_.mode), core_.table.crc, 0}),
                      false);
    change_ = {};
}

void ModeControl::enter(std::uint32_t mode) noexcept {
    mode_ = mode;
    ++core_.count.mode_changes;
    core_.raise(Event::mode_changed, no_node, 0, mode_);
}

void ModeControl::switch_over() noexcept {
    if (!armed_.prepared || core_.clock.cycle() < armed_.at) return;
    if (armed_.confirmed) {
        enter(armed_.mode);
    } else if (!core_.clock.seen()) {
        return;
    }
    armed_ = {};
}

void ModeControl::confirm(const Sync& s) noexcept {
    if (s.pending && armed_.prepared) {
        armed_.confirmed = true;
    }
}

void ModeControl::follow(const Sync& s) noexcept {
    if (!s.numbered || s.mode == mode_) {
        unknown_ = false;
        return;
    }
    const bool was_unknown = unknown_;
    unknown_ = !core_.table.has_mode(s.mode);
    if (!unknown_) {
        armed_ = {};
        return enter(s.mode);
    }
    if (!was_unknown) {
        core_.raise(Event::unknown_mode, no_node, 0, s.mode);
    }
}

bool ModeControl::settled(std::uint64_t cycle) const noexcept {
    if (!armed_.prepared || armed_.confirmed || cycle < armed_.at) return true;
    return core_.clock.cycle() >= armed_.at && core_.clock.seen();
}

}  // namespace hal::scocan
