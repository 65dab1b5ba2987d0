// SPDX-License-Identifier: MIT
#include "slot_monitor.hpp"

#include <algorithm>

namespace hal::tdma {

void SlotMonitor::tick(Time now) noexcept {
    duplicate_gate_.tick();
    intruder_gate_.tick();
    roster_.expire(now, gone_after);
}

/// A block without an address may belong to any station without a block; the sender of the syncs
/// has a block of a master.
bool SlotMonitor::may_send(const Other& other, const Address& from, bool named) const noexcept {
    if (named) return other.mac == from;
    if (other.mac != Address{}) return false;
    return other.role != Role::slave || !core_.is_own_thread() || from != core_.status.master;
}

/// In another thread than that of the station only the address is checked: the state belongs to the
/// station's.
SlotMonitor::Origin SlotMonitor::origin(const Address& from, Time arrived,
                                        std::size_t length) const noexcept {
    const auto& others = core_.setup.others;
    if (others.empty()) return Origin::plausible;
    const bool named = std::any_of(others.begin(), others.end(),
                                   [&](const Other& other) { return other.mac == from; });
    const auto sends = [&](const Other& other) { return may_send(other, from, named); };
    if (std::none_of(others.begin(), others.end(), sends)) return Origin::unknown_station;
    if (!core_.is_own_thread() || !core_.runs()) return Origin::plausible;
    const SlotTime at = core_.left_at(arrived, length);
    const bool in_slot = std::any_of(others.begin(), others.end(), [&](const Other& other) {
        return sends(other) && is_in_slot(other, at);
    });
    return in_slot ? Origin::plausible : Origin::out_of_slot;
}

/// Allows for the lateness of the sender, the path delay and the time stamp.
bool SlotMonitor::is_in_slot(const Other& other, SlotTime at) const noexcept {
    const Time cycle = core_.setup.cycle;
    const Time early = std::max<Time>(2'000, core_.setup.guard);
    const Time late = core_.setup.guard + std::max<Time>(20'000, cycle / 20);
    for (const SlotSetup& slot : other.slots) {
        const Time begin = slot.offset - early;
        const Time end = slot.offset + core_.wire(ethernet::header_bytes + slot.size) + late;
        const auto used_in = [&](std::uint32_t c) { return c % slot.period == slot.phasing; };
        if (used_in(at.cycle) && at.offset >= begin && at.offset <= end) return true;
        if (used_in(at.cycle - 1) && at.offset + cycle <= end) return true;
        if (used_in(at.cycle + 1) && at.offset - cycle >= begin) return true;
    }
    return false;
}

/// Returns the index of the station with an address: of the schedule, or of earlier frames.
std::optional<std::size_t> SlotMonitor::by_address(const Address& from) const noexcept {
    const auto& others = core_.setup.others;
    for (std::size_t n = 0; n < others.size(); ++n) {
        if (others[n].mac == from) return n;
    }
    for (std::size_t n = 0; n < others.size(); ++n) {
        if (others[n].mac == Address{} && roster_[n].from == from) return n;
    }
    return std::nullopt;
}

/// Returns the index of an unknown station in whose slot a frame was.
std::optional<std::size_t> SlotMonitor::by_slot(Time arrived, std::size_t length) const noexcept {
    if (!core_.runs()) return std::nullopt;
    const auto& others = core_.setup.others;
    const SlotTime at = core_.left_at(arrived, length);
    for (std::size_t n = 0; n < others.size(); ++n) {
        const bool unknown = others[n].mac == Address{} && !roster_[n].alive;
        if (unknown && is_in_slot(others[n], at)) return n;
    }
    return std::nullopt;
}

/// Returns the index of the last unknown station with the role of the sender of a sync.
std::optional<std::size_t> SlotMonitor::by_role(const Sync& sync) const noexcept {
    const auto& others = core_.setup.others;
    const bool master = core_.is_from_master(lateness_of(sync));
    const Role role = master ? Role::master : Role::backup;
    for (std::size_t n = others.size(); n-- > 0;) {
        const bool unknown = others[n].mac == Address{} && !roster_[n].alive;
        if (unknown && others[n].role == role) return n;
    }
    return std::nullopt;
}

std::optional<std::size_t> SlotMonitor::sender_of(const Decoded& d, Time arrived,
                                                  std::size_t length) const noexcept {
    if (const auto known = by_address(d.from)) return known;
    if (const auto found = by_slot(arrived, length)) return found;
    return d.kind == Kind::sync ? by_role(d.sync) : std::nullopt;
}

void SlotMonitor::note(const Decoded& d, Time arrived, std::size_t length, Time now) noexcept {
    if (roster_.size() == 0) return;
    // a reply is in the requester's slot
    const bool in_own_slot = d.kind != Kind::sync && d.kind != Kind::reply;
    const auto n = sender_of(d, arrived, length);
    if (!n) {
        if (in_own_slot) {
            check_duplicate(d.from, arrived, length);
        }
        return;
    }
    const bool late = in_own_slot && core_.runs() &&
                      !is_in_slot(core_.setup.others[*n], core_.left_at(arrived, length));
    roster_.frame(*n, d.from, now, late);
    if (d.kind == Kind::request && core_.status.leading) {
        roster_.stamp(*n, d.request.stamp, core_.clock.global(arrived));
    }
}

/// Detects a station that no block names in the slots of another one that sends, too: two stations
/// were given the same block.
void SlotMonitor::check_duplicate(const Address& from, Time arrived, std::size_t length) noexcept {
    if (!core_.runs()) return;
    const SlotTime at = core_.left_at(arrived, length);
    for (std::size_t n = 0; n < core_.setup.others.size(); ++n) {
        const Other& other = core_.setup.others[n];
        const Heard& first = roster_[n];
        if (!first.alive || first.from == from || !is_in_slot(other, at)) continue;
        duplicate_row_ = from == duplicate_ ? duplicate_row_ + 1 : 1;
        duplicate_ = from;
        if (duplicate_row_ >= confirmations && duplicate_gate_.pass()) {
            core_.report(Event::duplicate_slot, from, duplicate_value(first.from, other.index));
        }
        return;
    }
}

void SlotMonitor::check_own_slots(const std::deque<Slot>& slots, const Address& from, Time arrived,
                                  std::size_t length) noexcept {
    const Status& status = core_.status;
    if (status.state != State::running || !status.calibrated || core_.own_schedule) return;
    // frames of other slots are farther away
    const Time tolerance = std::max<Time>(2'000, core_.setup.guard / 2);
    const SlotTime at = core_.left_at(arrived, length);
    for (const Slot& s : slots) {
        const SlotSetup& slot = s.setup();
        const Time end = slot.offset + core_.wire(ethernet::header_bytes + slot.size);
        const bool inside = at.offset >= slot.offset - tolerance && at.offset <= end + tolerance;
        if (!s.used_in(at.cycle) || !inside) continue;
        ++core_.status.count.intruders;
        if (++intruder_row_ < confirmations || !intruder_gate_.pass()) continue;
        intruder_row_ = 0;
        core_.report(Event::foreign_frame, from, slot.id);
    }
}

}  // namespace hal::tdma
