// SPDX-License-Identifier: MIT
#include "station.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace hal::tdma {

const char* to_string(State state) noexcept {
    constexpr const char* words[] = {"listening", "synchronising", "calibrating",
                                     "running",   "withdrawn",     "unconfigured"};
    return words[static_cast<std::size_t>(state)];
}

namespace {

void check(const StationSetup& s) {
    if (s.cycle < 1000) throw std::invalid_argument("cycle below 1 us");
    if (s.slots.size() > most_slots) {
        throw std::invalid_argument(std::to_string(s.slots.size()) +
                                    " slots; a station has at most " + std::to_string(most_slots));
    }
    if (s.phase < 0 || s.phase >= s.cycle) throw std::invalid_argument("phase outside the cycle");
    if (s.backup_offset < 0 || s.backup_offset >= s.cycle) {
        throw std::invalid_argument("backup offset outside the cycle");
    }
    for (std::size_t i = 0; i < s.slots.size(); ++i) {
        const SlotSetup& slot = s.slots[i];
        const std::string which = "slot " + std::to_string(slot.id);
        if (slot.offset < 0 || slot.offset >= s.cycle) {
            throw std::invalid_argument(which + " is outside the cycle");
        }
        if (slot.period == 0 || slot.phasing >= slot.period) {
            throw std::invalid_argument(which + ": phasing exceeds its period");
        }
        if (slot.size > ethernet::largest_frame - ethernet::header_bytes) {
            throw std::invalid_argument(which + " is longer than a frame");
        }
        for (std::size_t k = 0; k < i; ++k) {
            if (s.slots[k].id == slot.id) throw std::invalid_argument("duplicate " + which);
        }
    }
}

}  // namespace

Station::Station(const StationSetup& setup, Events* events) : events_(events) {
    check(setup);
    setup_ = setup;
    setup_.slots.reserve(most_slots);
    roster_ = Roster(setup_.others.size());
    pings_ = Pings(setup_.others.size() + (setup_.asks_master ? 1 : 0));
    for (const SlotSetup& s : setup.slots) {
        slots_.emplace_back(s, setup.queue);
    }
    while (slots_.size() < std::min(setup.slot_capacity, most_slots)) {
        slots_.emplace_back(SlotSetup{.id = unused_slot, .size = 0}, setup.queue);
    }
    begin();
}

void Station::attach(ethernet::Port& port) {
    port_ = &port;
    address_ = port.address();
    for (Slot& s : slots_) {
        s.clear();
    }
    status_.count = {};
    roster_.clear();
    unheard_reported_ = false;
    no_carrier_ = 0;
    begin();
}

bool Station::reconfigure(const StationSetup& s) noexcept {
    if (s.cycle < 1000 || s.slots.size() > slots_.size()) return false;
    for (std::size_t i = 0; i < s.slots.size(); ++i) {
        slots_[i].change(s.slots[i]);
    }
    for (std::size_t i = s.slots.size(); i < slots_.size(); ++i) {
        slots_[i].change({.id = unused_slot, .size = 0});
    }
    setup_.role = s.role;
    setup_.cycle = s.cycle;
    setup_.backup_offset = s.backup_offset;

    setup_.phase = s.phase;
    setup_.lead = s.lead;
    setup_.guard = s.guard;
    setup_.lost_limit = s.lost_limit;
    setup_.rounds = s.rounds;
    setup_.speed = s.speed;

    setup_.babble_limit = s.babble_limit;
    setup_.backup_from = s.backup_from;
    setup_.slots.assign(s.slots.begin(), s.slots.end());  // within the reserved capacity
    setup_.configured = true;
    begin();
    return true;
}

void Station::begin() noexcept {
    const Counters kept = status_.count;
    status_ = {};
    status_.count = kept;
    if (!setup_.configured) {
        status_.state = State::unconfigured;
    }
    clock_.clear();
    babble_monitor_.clear();
    followers_.clear();
    pings_.clear_answers();
    other_heard_ = 0;
    other_reported_ = established_ = false;
    for (Pending& p : pending_) {
        p.used = false;
    }
    based_ = heard_ever_ = sent_any_ = own_schedule_ = false;
    began_ = 0;
    good_row_ = foreign_row_ = intruder_row_ = 0;
    lead_wait_ = 0;
    measured_ = {};
    calibration_.begin(setup_.rounds);
    recalibration_ = 0;
    claimants_ = {};
    newcomer_row_ = 0;
    unfit_sync_ = 0;
    master_row_ = out_of_step_ = 0;
    schedule_reported_ = false;
    limit_ = setup_.babble_limit != 0 ? setup_.babble_limit : 64;
    ready_.store(false, std::memory_order_relaxed);
}

void Station::reset() noexcept {
    if (status_.state == State::withdrawn) {
        begin();
    }
}

void Station::restart() noexcept {
    for (Slot& s : slots_) {
        s.clear();
    }
    begin();
}

void Station::become(State state, Time) noexcept {
    status_.state = state;
    const bool ready = state == State::running;
    ready_.store(ready, std::memory_order_relaxed);
    if (ready) {
        report(Event::running);
    } else {
        for (Slot& s : slots_) {
            s.clear();  // stale frames must not be sent after the next sync
        }
    }
}

const Slot* Station::find(unsigned id) const noexcept {
    for (const Slot& s : slots_) {
        if (s.id() == id) return &s;
    }
    if (id == tunnel_slot) return find(default_slot);
    return nullptr;
}

std::size_t Station::waiting(unsigned slot) const noexcept {
    const Slot* s = find(slot);
    return s == nullptr ? 0 : s->waiting();
}

std::size_t Station::room(unsigned slot) const noexcept {
    const Slot* s = find(slot);
    return s == nullptr ? 0 : s->room();
}

ethernet::Sent Station::send(std::span<const std::uint8_t> frame, unsigned slot, unsigned priority,
                             ethernet::Finisher* finisher) noexcept {
    using enum ethernet::Sent;
    Slot* s = const_cast<Slot*>(find(slot));
    ethernet::Sent result = queued;
    if (s == nullptr || frame.size() < ethernet::header_bytes ||
        frame.size() > ethernet::header_bytes + s->room()) {
        result = rejected;
    } else if (!ready()) {
        result = down;
    } else if (!s->push(frame, std::min(priority, last_priority), finisher)) {
        result = full;
    }
    if (result != queued && result != full) {
        // full: the sender keeps it
        rejected_.fetch_add(1, std::memory_order_relaxed);
    }
    return result;
}

}  // namespace hal::tdma
