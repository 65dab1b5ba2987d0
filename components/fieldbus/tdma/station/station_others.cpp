// SPDX-License-Identifier: MIT
// Unexpected stations: a second master, an unknown master, frames outside the slots of their
// sender.
#include <algorithm>
#include <cstdlib>

#include "station.hpp"

namespace hal::tdma {

/// Updates and returns what is known of the sender's schedule.
const Station::Claimant& Station::claim(const Decoded& d) noexcept {
    const Sync& s = d.sync;
    Claimant* c = nullptr;
    for (Claimant& known : claimants_) {
        if (known.row != 0 && known.who == d.from) {
            c = &known;
        }
    }
    if (c == nullptr) {
        c = &claimants_[next_claimant_++ % claimants_.size()];
        *c = {d.from, s.cycle, 1, s.scheduled, 0};
        return *c;
    }
    const auto cycles = static_cast<std::int32_t>(s.cycle - c->cycle);
    const Time every = cycles > 0 && cycles < 1000 ? (s.scheduled - c->scheduled) / cycles : 0;
    const bool goes_on = every > 0 && (c->row == 1 || std::abs(every - c->every) <= setup_.guard);
    *c = {d.from, s.cycle, goes_on ? c->row + 1 : 1, s.scheduled, every};
    return *c;
}

/// Handles a sync of another schedule.
void Station::take_foreign_sync(const Decoded& d, Time now) noexcept {
    ++status_.count.foreign;
    const bool is_master = !status_.leading && d.from == status_.master;
    if (is_master && ++foreign_row_ >= rows) {  // it restarted with a new schedule
        report(Event::sync_lost, d.from, 0);
        ++status_.count.losses;
        return begin();
    }
    if (claim(d).row < rows || is_master) return;
    const bool first = other_heard_ == 0;
    other_ = d.from;
    other_heard_ = now;
    if (first) {
        established_ = followers_.any(now, gone_after);
    }
    if (foreign_gap_ == 0 || !other_reported_) {
        foreign_gap_ = silence_after;
        other_reported_ = true;
        report(Event::other_master, d.from);
    }
    if (!status_.leading || established_) {
        return;  // a schedule with followers is kept
    }
    const Time lateness = d.sync.stamp - d.sync.scheduled;
    if (setup_.role == Role::master && is_from_master(lateness)) {
        if (d.from < address_) {
            unfit_sync_ = now;
            withdraw(Event::withdrew, d.from);
        }
        return;
    }
    // A backup yields to a master; a master that finds a backup's schedule listens and takes that
    // over.
    if (setup_.role == Role::master || is_from_master(lateness)) {
        report(Event::yielded, d.from);
        begin();
        began_ = unfit_sync_ = now;
    }
}

/// The addresses of the master and its backups in the schedule are an allow list.
bool Station::is_allowed(const Address& master) noexcept {
    if (setup_.masters.empty() ||
        std::find(setup_.masters.begin(), setup_.masters.end(), master) != setup_.masters.end()) {
        return true;
    }
    ++status_.count.foreign;
    if (unknown_gap_ == 0) {
        unknown_gap_ = silence_after;
        report(Event::unknown_master, master);
    }
    return false;
}

/// A station that led and was cut off for this duration has lost its followers: when it meets
/// another schedule, that one takes precedence.
void Station::check_carrier(Time now) noexcept {
    if (!port_->statistics().up) {
        if (no_carrier_ == 0) {
            no_carrier_ = now;
        }
        return;
    }
    const bool was_long = no_carrier_ != 0 &&
                          now - no_carrier_ >= static_cast<Time>(setup_.lost_limit) * setup_.cycle;
    no_carrier_ = 0;
    if (was_long) {
        followers_.clear();
    }
}

void Station::withdraw(Event why, const Address& who) noexcept {
    status_.leading = status_.synchronous = false;
    status_.master = who;
    become(State::withdrawn, 0);
    report(why, who);
}

/// With a schedule from RTcfg a station knows its own block only, and accepts all senders. In
/// another thread than that of the station only the address is checked: the state belongs to the
/// station's.
ethernet::Discipline::Origin Station::origin(const Address& from, std::int64_t arrived,
                                             std::size_t length) const noexcept {
    if (setup_.others.empty()) return Origin::plausible;
    const bool own_thread = thread_.load(std::memory_order_relaxed) == pthread_self();
    const bool named = std::any_of(setup_.others.begin(), setup_.others.end(),
                                   [&](const Other& o) { return o.mac == from; });
    // A block without an address may belong to any station without a block; the sender of the syncs
    // has a block of a master.
    const auto may_be = [&](const Other& o) {
        return named ? o.mac == from
                     : o.mac == Address{} &&
                           (o.role != Role::slave || !own_thread || from != status_.master);
    };
    if (std::none_of(setup_.others.begin(), setup_.others.end(), may_be)) {
        return Origin::unknown_station;
    }
    if (!own_thread || status_.state != State::running || !based_) return Origin::plausible;
    std::uint32_t cycle = 0;
    const Time at = left_at(arrived, length, cycle);
    for (const Other& o : setup_.others) {
        if (may_be(o) && is_in_slot(o, at, cycle)) return Origin::plausible;
    }
    return Origin::out_of_slot;
}

/// Allows for the lateness of the sender, the path delay and the time stamp.
bool Station::is_in_slot(const Other& o, Time at, std::uint32_t cycle) const noexcept {
    const Time early = std::max<Time>(2'000, setup_.guard);

    const Time late = setup_.guard + std::max<Time>(20'000, setup_.cycle / 20);
    for (const SlotSetup& slot : o.slots) {
        const Time end = slot.offset + wire(ethernet::header_bytes + slot.size) + late;
        const auto used_in = [&](std::uint32_t c) { return c % slot.period == slot.phasing; };
        if (used_in(cycle) && at >= slot.offset - early && at <= end) return true;
        if (used_in(cycle - 1) && at + setup_.cycle <= end) return true;
        if (used_in(cycle + 1) && at - setup_.cycle >= slot.offset - early) return true;
    }
    return false;
}

/// Returns the index of the sender: by its address, or for blocks without one by earlier frames,
/// its syncs, or its slot.
std::size_t Station::other_of(const Address& from, Time arrived,
                              std::size_t length) const noexcept {
    const auto& others = setup_.others;
    for (std::size_t n = 0; n < others.size(); ++n) {
        if (others[n].mac == from) return n;
    }
    for (std::size_t n = 0; n < others.size(); ++n) {
        if (others[n].mac == Address{} && roster_[n].from == from) return n;
    }
    if (status_.state != State::running || !based_) return others.size();
    std::uint32_t cycle = 0;
    const Time at = left_at(arrived, length, cycle);
    for (std::size_t n = 0; n < others.size(); ++n) {
        if (others[n].mac == Address{} && !roster_[n].alive && is_in_slot(others[n], at, cycle)) {
            return n;
        }
    }
    return others.size();
}

void Station::note(const Decoded& d, Time arrived, std::size_t length, Time now) noexcept {
    // a reply is in the requester's slot
    const bool by_slot = d.kind != Kind::sync && d.kind != Kind::reply;
    std::size_t n = other_of(d.from, arrived, length);
    if (d.kind == Kind::sync && n == setup_.others.size()) {  // a block without an address
        const Role role =
            is_from_master(d.sync.stamp - d.sync.scheduled) ? Role::master : Role::backup;
        for (std::size_t i = 0; i < setup_.others.size(); ++i) {
            if (const Other& o = setup_.others[i];
                o.mac == Address{} && o.role == role && !roster_[i].alive) {
                n = i;
            }
        }
    }
    if (n == setup_.others.size()) {
        if (by_slot) {
            check_duplicate(d.from, arrived, length);
        }
        return;
    }
    const bool knows = status_.state == State::running && based_ && by_slot;
    std::uint32_t cycle = 0;
    const Time at = left_at(arrived, length, cycle);
    roster_.frame(n, d.from, now, knows && !is_in_slot(setup_.others[n], at, cycle));
    if (d.kind == Kind::request && status_.leading) {
        roster_.stamp(n, d.request.stamp, clock_.global(arrived));
    }
}

/// Detects a station that no block names in the slots of another one that sends, too: two stations
/// were given the same block.
void Station::check_duplicate(const Address& from, Time arrived, std::size_t length) noexcept {
    if (status_.state != State::running || !based_) return;
    std::uint32_t cycle = 0;
    const Time at = left_at(arrived, length, cycle);
    for (std::size_t n = 0; n < setup_.others.size(); ++n) {
        const Heard& first = roster_[n];
        if (!first.alive || first.from == from || !is_in_slot(setup_.others[n], at, cycle)) {
            continue;
        }
        duplicate_row_ = from == duplicate_ ? duplicate_row_ + 1 : 1;
        duplicate_ = from;
        if (duplicate_row_ < rows || duplicate_gap_ != 0) return;
        duplicate_gap_ = silence_after;
        report(Event::duplicate_slot, from, duplicate_value(first.from, setup_.others[n].index));
        return;
    }
}

/// The stamps are from the other station's clock: two of them give its drift.
void Station::take_echo(const Decoded& d, Time arrived) noexcept {
    for (std::size_t n = 0; n < pings_.size(); ++n) {
        if (!pings_.take(n, d.from, d.echo, arrived)) continue;
        if (clock_.known()) {
            roster_.stamp(n, d.echo.stamp, clock_.global(arrived));
        }
        return;
    }
    ++status_.count.foreign;
}

/// Detects frames of other stations in own slots; needs the path delay.
void Station::check_slot(std::span<const std::uint8_t> frame, const Address& from,
                         Time arrived) noexcept {
    if (status_.state != State::running || !status_.calibrated || own_schedule_) return;
    // frames of other slots are farther away
    const Time tolerance = std::max<Time>(2'000, setup_.guard / 2);
    std::uint32_t cycle = 0;
    const Time at = left_at(arrived, frame.size(), cycle);
    for (const Slot& s : slots_) {
        const SlotSetup& slot = s.setup();
        if (!s.used_in(cycle) || at < slot.offset - tolerance ||
            at > slot.offset + wire(ethernet::header_bytes + slot.size) + tolerance) {
            continue;
        }
        ++status_.count.intruders;
        if (++intruder_row_ >= rows && intruder_gap_ == 0) {
            intruder_gap_ = silence_after;
            intruder_row_ = 0;
            report(Event::foreign_frame, from, slot.id);
        }
    }
}

}  // namespace hal::tdma
