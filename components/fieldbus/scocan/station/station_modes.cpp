// SPDX-License-Identifier: MIT
// Mode changes: the SYNC node asks all nodes to prepare; when all are ready, the SYNCs announce the
// change, and all switch at one cycle.
#include "station.hpp"

namespace hal::scocan {

namespace {
/// Cycles from the request to the switch, and those in which the SYNCs announce it. The answers use
/// shared slots.
constexpr std::uint32_t change_cycles = 16;
constexpr std::uint32_t pending_cycles = 4;
}  // namespace

bool Station::change_mode(std::uint32_t mode) noexcept {
    if (!leading_ || change_.active || !table_.has_mode(mode) || mode == mode_) return false;
    change_ = {};
    change_.active = true;
    change_.mode = mode;
    change_.at = clock_.cycle() + change_cycles;
    change_.ready[node_] = true;
    queue_.push(encode(Request{Request::What::prepare, static_cast<std::uint8_t>(mode), table_.crc,
                               static_cast<std::uint8_t>(counter_of(change_.at))}),
                no_slot, false, false);
    return true;
}

void Station::configuration(const can::Frame& frame) noexcept {
    if (Request r; decode(frame, r)) {
        requested(r);
    } else if (Answer a; decode(frame, a)) {
        answered(a);
    }
}

/// Handles a message of the node that sends the SYNC.
void Station::requested(const Request& r) noexcept {
    if (r.what == Request::What::silence || r.what == Request::What::resume) {
        return silence_requested(r);
    }
    if (leading_) return;
    const bool agrees = r.crc == table_.crc;
    if (agrees == listen_only_) {
        listen_only_ = !agrees;
        raise(agrees ? Event::table_agrees : Event::other_table, no_node, 0, r.crc);
        // it followed another SYNC node, in another phase
        if (agrees && !is_sync_node()) {
            clock_.clear();
            numbered_ = false;
        }
    }
    if (!agrees || r.what == Request::What::table) return;
    armed_ = {};
    if (r.what == Request::What::cancel || !numbered_) return;
    Answer answer{static_cast<std::uint32_t>(node_), r.mode, Answer::Reason::ready, table_.crc};
    if (table_.has_mode(r.mode)) {
        armed_ = {true, false, r.mode,
                  clock_.cycle() + (r.at_counter + counter_cycles - counter_) % counter_cycles};
    } else {
        answer.reason = Answer::Reason::unknown_mode;
    }
    queue_.push(encode(answer), no_slot, false, true);
}

bool Station::request_silence(std::uint32_t node, bool silent) noexcept {
    if (role_ != Role::monitor || node >= table_.nodes.size() || node == node_) return false;
    const auto what = silent ? Request::What::silence : Request::What::resume;
    return queue_.push(encode(Request{what, static_cast<std::uint8_t>(node), table_.crc, 0}),
                       no_slot, false, false);
}

/// Handles the monitor's request to send nothing, or to send again. Nodes of another table have
/// other numbers.
void Station::silence_requested(const Request& r) noexcept {
    if (r.mode != node_ || r.crc != table_.crc) return;
    if (r.what == Request::What::resume) return reset();
    if (!silenced_) {
        raise(Event::silenced_by_monitor, static_cast<std::uint32_t>(node_));
    }
    silenced_ = true;
    leading_ = false;
    change_ = {};
}

void Station::answered(const Answer& a) noexcept {
    if (!change_.active || change_.agreed || a.node >= table_.nodes.size() ||
        a.mode != change_.mode) {
        return;
    }
    if (a.reason != Answer::Reason::ready) return refuse(a.node, a.reason);
    change_.ready[a.node] = true;
}

/// Continues a mode change, once a cycle.
void Station::change_cycle() noexcept {
    if (!change_.active) return;
    const std::uint64_t now = clock_.cycle();
    if (change_.agreed) {
        if (now >= change_.at) {
            change_ = {};
        }
        return;
    }
    if (now + pending_cycles < change_.at) return;
    for (std::size_t i = 0; i < table_.nodes.size(); ++i) {
        if (!change_.ready[i]) {
            return refuse(static_cast<std::uint32_t>(i), Answer::Reason::offline);
        }
    }
    change_.agreed = true;
    armed_ = {true, true, change_.mode, change_.at};
}

void Station::refuse(std::uint32_t who, Answer::Reason reason) noexcept {
    raise(Event::mode_refused, who, change_.mode, static_cast<Time>(reason));
    queue_.push(encode(Request{Request::What::cancel, static_cast<std::uint8_t>(change_.mode),
                               table_.crc, 0}),
                no_slot, false, false);
    change_ = {};
}

/// Switches at the begin of the agreed cycle, or forgets a change that was not agreed.
void Station::switch_mode() noexcept {
    if (!armed_.prepared || clock_.cycle() < armed_.at) return;
    if (armed_.confirmed) {
        mode_ = armed_.mode;
        ++count_.mode_changes;
        raise(Event::mode_changed, no_node, 0, mode_);
    } else if (!clock_.seen()) {
        return;
    }
    armed_ = {};
}

}  // namespace hal::scocan
