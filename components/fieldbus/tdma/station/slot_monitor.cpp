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

/// Returns how long after the begin of the last of these slots a frame began, ns; the length of a
/// cycle or more when none was in that time.
Time SlotMonitor::after_slot(const std::vector<SlotSetup>& slots, SlotTime at) const noexcept {
    constexpr Time stamp_error = 2'000;
    const Time cycle = core_.setup.cycle;
    Time nearest = cycle;
    for (const SlotSetup& slot : slots) {
        for (const int turn : {-1, 0, 1}) {
            const Time after = at.offset + stamp_error - slot.offset - turn * cycle;
            const std::uint32_t number = at.cycle + static_cast<std::uint32_t>(turn);
            const bool is_used = number % slot.period == slot.phasing;
            if (is_used && after >= 0) {
                nearest = std::min(nearest, after);
            }
        }
    }
    return nearest;
}

/// Returns the index of the other station in whose slot a frame began: of all slots, also those of
/// this station, the one that begins last before the frame. The windows of is_in_slot() overlap,
/// because they allow for a late sender.
std::optional<std::size_t> SlotMonitor::block_at(SlotTime at) const noexcept {
    const auto& others = core_.setup.others;
    Time nearest = after_slot(core_.setup.slots, at);
    std::optional<std::size_t> block;
    for (std::size_t n = 0; n < others.size(); ++n) {
        const Time after = after_slot(others[n].slots, at);
        if (after >= nearest) continue;
        nearest = after;
        block = n;
    }
    return block && is_in_slot(others[*block], at) ? block : std::nullopt;
}

bool SlotMonitor::is_elsewhere(const Address& from, Time arrived, std::size_t length,
                               SlotTime there) const noexcept {
    const auto n = by_address(from);
    if (!n || !core_.runs()) return false;
    const auto& slots = core_.setup.others[*n].slots;
    const Time late = core_.setup.guard + std::max<Time>(20'000, core_.setup.cycle / 20);
    const Time after = after_slot(slots, there);
    constexpr Time margin = 5'000;
    return after <= late && after + margin < after_slot(slots, core_.left_at(arrived, length));
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

/// Returns true for a block without an address, while no station with it is online.
bool SlotMonitor::is_unknown(std::size_t n) const noexcept {
    return core_.setup.others[n].mac == Address{} && !roster_[n].alive;
}

/// Returns the index of an unknown station in whose slot a frame was.
std::optional<std::size_t> SlotMonitor::by_slot(Time arrived, std::size_t length) const noexcept {
    if (!core_.runs() || !learns_) return std::nullopt;
    const auto n = block_at(core_.left_at(arrived, length));
    return n && is_unknown(*n) ? n : std::nullopt;
}

/// Returns the index of the last unknown station with the role of the sender of a sync.
std::optional<std::size_t> SlotMonitor::by_role(const Sync& sync) const noexcept {
    const auto& others = core_.setup.others;
    const bool master = core_.is_from_master(lateness_of(sync));
    const Role role = master ? Role::master : Role::backup;
    for (std::size_t n = others.size(); n-- > 0;) {
        if (is_unknown(n) && others[n].role == role) return n;
    }
    return std::nullopt;
}

std::optional<std::size_t> SlotMonitor::sender_of(const Decoded& d, Time arrived,
                                                  std::size_t length) const noexcept {
    if (const auto known = by_address(d.from)) return known;
    if (d.kind == Kind::sync) return by_role(d.sync);
    // a reply is in the requester's slot
    return d.kind == Kind::reply ? std::nullopt : by_slot(arrived, length);
}

/// Forgets the address of station `n` when its frames are in the slots of another one that is
/// unknown, or whose frames are elsewhere, too: it was learned for the wrong block.
void SlotMonitor::check_block(std::size_t n, Time arrived, std::size_t length) noexcept {
    if (core_.setup.others[n].mac != Address{} || !core_.runs() || !learns_) return;
    const auto block = block_at(core_.left_at(arrived, length));
    if (!block) return;
    roster_.placed(n, *block == n);
    if (roster_.misplaced(n) < confirmations) return;
    if (is_unknown(*block) || roster_.misplaced(*block) >= confirmations) {
        roster_.forget(n);
    }
}

void SlotMonitor::note(const Decoded& d, Time arrived, std::size_t length, Time now) noexcept {
    if (roster_.size() == 0) return;
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
    if (in_own_slot) {
        check_block(*n, arrived, length);
    }
    if (d.kind == Kind::request && core_.status.leading) {
        roster_.stamp(*n, d.request.stamp, core_.clock.global(arrived));
    }
}

/// Detects a station that no block names in the slots of another one that sends, too: two stations
/// were given the same block.
void SlotMonitor::check_duplicate(const Address& from, Time arrived, std::size_t length) noexcept {
    if (!core_.runs() || !learns_) return;
    const auto n = block_at(core_.left_at(arrived, length));
    if (!n || !roster_[*n].alive || roster_[*n].from == from) return;
    duplicate_row_ = from == duplicate_ ? duplicate_row_ + 1 : 1;
    duplicate_ = from;
    if (duplicate_row_ >= confirmations && duplicate_gate_.pass()) {
        core_.report(Event::duplicate_slot, from,
                     duplicate_value(roster_[*n].from, core_.setup.others[*n].index));
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
