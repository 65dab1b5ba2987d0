// SPDX-License-Identifier: MIT
#include "station.hpp"

#include <algorithm>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <utility>

namespace hal::tdma {

const char* to_string(State state) noexcept {
    constexpr const char* words[] = {"listening", "synchronising", "calibrating",
                                     "running",   "withdrawn",     "unconfigured"};
    return words[static_cast<std::size_t>(state)];
}

namespace {

// in a cycle: a babbling station must not hold the thread
constexpr std::size_t max_arrivals = 1024;
// ns; after more a master listens before it sends
constexpr Time max_absence = 100'000'000;
// cycles after which a returning master needs a new calibration
constexpr std::uint32_t max_return = 100;
// delay of a master after another one's sync
constexpr Time unfit_for = 100'000'000;
constexpr Time min_listening = 3'000'000;
constexpr Time unheard_after = 5'000'000'000;
// coming into phase takes a fraction of this
constexpr Time out_of_step_after = 5'000'000'000;
constexpr std::uint32_t max_unanswered = 20;

void check(const StationSetup& s) {
    if (s.cycle < 1000) throw std::invalid_argument("cycle below 1 us");
    if (s.slots.size() > max_slots) {
        throw std::invalid_argument(std::to_string(s.slots.size()) +
                                    " slots; a station has at most " + std::to_string(max_slots));
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
        if (slot.size > ethernet::max_frame - ethernet::header_bytes) {
            throw std::invalid_argument(which + " is longer than a frame");
        }
        for (std::size_t k = 0; k < i; ++k) {
            if (s.slots[k].id == slot.id) throw std::invalid_argument("duplicate " + which);
        }
    }
}

}  // namespace

Station::Station(const StationSetup& setup, Events* events) {
    check(setup);
    core_.events = events;
    core_.setup = setup;
    core_.setup.slots.reserve(max_slots);
    slot_monitor_.set_up();
    pings_ = Pings(setup.others.size() + (setup.asks_master ? 1 : 0));
    transmitter_.set_up();
    begin();
}

void Station::attach(ethernet::Port& port) {
    core_.port = &port;
    core_.address = port.address();
    core_.status.count = {};
    rejected_.store(0, std::memory_order_relaxed);
    slot_monitor_.clear();
    unheard_reported_ = false;
    no_carrier_ = 0;
    begin();
}

bool Station::reconfigure(const StationSetup& s) noexcept {
    if (s.cycle < 1000 || !transmitter_.change(s.slots)) return false;
    StationSetup& setup = core_.setup;
    setup.role = s.role;
    setup.cycle = s.cycle;
    setup.backup_offset = s.backup_offset;
    setup.phase = s.phase;
    setup.lead = s.lead;
    setup.guard = s.guard;
    setup.lost_limit = s.lost_limit;
    setup.rounds = s.rounds;
    setup.speed = s.speed;
    setup.babble_limit = s.babble_limit;
    setup.backup_from = s.backup_from;
    setup.slots.assign(s.slots.begin(), s.slots.end());  // within the reserved capacity
    setup.configured = true;
    begin();
    return true;
}

void Station::begin() noexcept {
    stop_sending();
    const Counters kept = core_.status.count;
    core_.status = {};
    core_.status.count = kept;
    if (!core_.setup.configured) {
        core_.status.state = State::unconfigured;
    }
    core_.clock.clear();
    core_.grid_known = false;
    core_.own_schedule = false;
    babble_monitor_.clear();
    followers_.clear();
    pings_.clear_answers();
    other_masters_.restart();
    parallel_master_.restart();
    slot_monitor_.restart();
    transmitter_.restart();
    calibration_.begin(core_.setup.rounds);
    sync_.ever = false;
    began_ = 0;
    unfit_sync_ = 0;
    good_row_ = foreign_row_ = master_row_ = 0;
    newcomer_.reset();
    measured_ = {};
    lead_wait_ = 0;
    out_of_step_ = 0;
    schedule_reported_ = false;
    babble_limit_ = core_.setup.babble_limit != 0 ? core_.setup.babble_limit : 64;
}

/// Drops what is queued: stale frames must not be sent after the next sync. The order matters to
/// threads in send(), see slots.hpp.
void Station::stop_sending() noexcept {
    may_queue_ = false;
    core_.has_stale_frames = true;
    open_queues();
}

/// Shows senders whether they may queue frames, and drops stale ones. While another thread has the
/// queues, the next cycle does that.
void Station::open_queues() noexcept {
    if (!core_.has_stale_frames && may_queue_ == ready_.load(std::memory_order_relaxed)) return;
    const link::OrderedCall call(core_.order, link::OrderedCall::Wait::bounded);
    if (!call.is_made()) return;
    if (core_.has_stale_frames) {
        ready_.store(false, std::memory_order_relaxed);
        transmitter_.clear_slots();
        core_.has_stale_frames = false;
    }
    ready_.store(may_queue_, std::memory_order_relaxed);
}

/// Starts anew in a cycle that has begun.
void Station::begin_at(Time now) noexcept {
    begin();
    began_ = now;
}

void Station::reset() noexcept {
    if (core_.status.state == State::withdrawn) {
        begin();
    }
}

void Station::restart() noexcept { begin(); }

void Station::become(State state) noexcept {
    core_.status.state = state;
    if (state != State::running) return stop_sending();
    may_queue_ = true;
    open_queues();
    report(Event::running);
}

std::uint64_t Station::dropped(const ethernet::Statistics& port) const noexcept {
    std::uint64_t rejected = rejected_.load(std::memory_order_relaxed);
    link::JournaledCall call;
    call.number(rejected);
    return rejected + core_.status.count.cleared + port.dropped;
}

std::size_t Station::waiting(unsigned slot) const noexcept {
    const Slot* s = transmitter_.find(slot);
    if (s == nullptr) return 0;
    return link::ordered_value(core_.order, [s] { return s->waiting(); },
                               [](link::JournaledCall& call, auto& count) { call.number(count); });
}

std::size_t Station::capacity(unsigned slot) const noexcept {
    const auto read = [&] {
        const Slot* s = transmitter_.find(slot);
        return s == nullptr ? std::size_t{0} : s->capacity();
    };
    return link::ordered_value(core_.order, read,
                               [](link::JournaledCall& call, auto& bytes) { call.number(bytes); });
}

bool Station::ready() const noexcept {
    return link::ordered_value(core_.order, [this] {
        return ready_.load(std::memory_order_relaxed);
    }, [](link::JournaledCall& call, bool& is_ready) { call.number(is_ready); });
}

ethernet::Sent Station::send(std::span<const std::uint8_t> frame, unsigned slot, unsigned priority,
                             ethernet::Finisher* finisher) noexcept {
    using enum ethernet::Sent;
    const link::OrderedCall call(core_.order, link::OrderedCall::Wait::bounded);
    if (!call.is_made()) return full;  // another thread has the queues: the sender keeps it
    const Transmitter::Target to = transmitter_.target(slot);  // before ready()
    Slot* const s = to.slot;
    ethernet::Sent result = queued;
    if (s == nullptr || frame.size() < ethernet::header_bytes ||
        frame.size() > ethernet::header_bytes + s->capacity()) {
        result = rejected;
    } else if (!ready_.load(std::memory_order_relaxed)) {
        result = down;
    } else if (!s->push(frame, std::min(priority, last_priority), finisher, to.epoch)) {
        result = full;
    }
    if (result != queued && result != full) {
        // full: the sender keeps it
        count_dropped();
    }
    return result;
}

// Received frames.

void Station::receive(Time now) noexcept {
    core_.thread.store(link::calling_thread(), std::memory_order_relaxed);
    if (core_.port == nullptr) return;
    open_queues();
    const Time absence = now - std::exchange(last_cycle_, now);
    const Time max_pause = std::max<Time>(max_absence, core_.setup.lost_limit * core_.setup.cycle);
    if (core_.status.leading && absence > max_pause) {
        restart();
    }
    const bool first = began_ == 0;
    if (first) {
        began_ = now;
    }
    sync_.received = false;
    check_carrier(now);
    for (std::size_t i = 0; i < max_arrivals; ++i) {
        const auto arrival = core_.port->receive(now);
        if (!arrival) break;
        // received before the thread's first cycle
        if (first && arrival->time_ns < now - core_.setup.cycle) continue;
        accept(*arrival, now);
    }
    other_masters_.tick();
    babble_gate_.tick();
    slot_monitor_.tick(now);
    check_babble();
    pings_.expire(now, std::max(Pings::timeout, 20 * core_.setup.cycle),
                  core_.status.state == State::running);
    advance(now);
    count_silence();
    other_masters_.expire(now);
    update_state(now);
}

void Station::check_babble() noexcept {
    std::uint32_t frames = 0;
    const Address* who = babble_monitor_.babbler(babble_limit_, frames);
    if (who != nullptr && babble_gate_.pass()) {
        report(Event::babbling, *who, frames);
    }
}

/// A station that led and was cut off for this duration has lost its followers: when it meets
/// another schedule, that one takes precedence.
void Station::check_carrier(Time now) noexcept {
    if (!core_.port->statistics().up) {
        if (no_carrier_ == 0) {
            no_carrier_ = now;
        }
        return;
    }
    const Time max_pause = static_cast<Time>(core_.setup.lost_limit) * core_.setup.cycle;
    const bool was_long = no_carrier_ != 0 && now - no_carrier_ >= max_pause;
    no_carrier_ = 0;
    if (was_long) {
        followers_.clear();
    }
}

void Station::accept(const ethernet::Arrival& arrival, Time now) noexcept {
    const auto frame = arrival.bytes;
    const Time arrived = arrival.time_ns;
    if (frame.size() < ethernet::header_bytes) {
        ++core_.status.count.foreign;
        return;
    }
    const Decoded d = decode(frame);
    if (d.from == core_.address) return;
    babble_monitor_.heard(d.from, arrived, core_.setup.cycle);
    if (rtcfg_ != nullptr) {
        rtcfg_->heard(d.from, now);
    }
    if (core_.status.state == State::unconfigured && d.kind != Kind::none) return;
    slot_monitor_.learn(!other_masters_.present());
    slot_monitor_.note(d, arrived, frame.size(), now);
    if (d.kind == Kind::sync) return accept_sync(d, arrived, now);
    if (d.kind != Kind::request && !other_masters_.is(d.from)) {
        const auto there = other_masters_.left_at(arrived, frame.size());
        const bool elsewhere =
            there && slot_monitor_.is_elsewhere(d.from, arrived, frame.size(), *there);
        followers_.sent(d.from, now, elsewhere);
    }
    if (d.kind == Kind::none && d.defect != Defect::ethertype) {
        ++core_.status.count.foreign;
        return;
    }
    if (d.kind != Kind::reply) {  // that is in the requester's slot
        slot_monitor_.check_own_slots(transmitter_.slots(), d.from, arrived, frame.size());
    }
    if (d.kind == Kind::none) return accept_rtcfg(frame, now);
    if (d.kind == Kind::tunnelled && tunnel_ != nullptr) {
        tunnel_->arrived(frame, now);
    } else if (d.to == core_.address) {
        accept_addressed(d, arrived);
    }
}

void Station::accept_rtcfg(std::span<const std::uint8_t> frame, Time now) noexcept {
    const unsigned ethertype = static_cast<unsigned>(frame[12] << 8 | frame[13]);
    if (rtcfg_ != nullptr && ethertype == rtcfg_type) {
        rtcfg_->arrived(frame, now);
    }
}

/// Handles a frame for this station.
void Station::accept_addressed(const Decoded& d, Time arrived) noexcept {
    switch (d.kind) {
    case Kind::request: return accept_request(d, arrived);
    case Kind::reply: return accept_reply(d, arrived);
    case Kind::ping:
        if (core_.status.state == State::running) {
            pings_.queue_answer({d.from, d.ping.stamp, arrived, d.ping.number});
        }
        return;
    case Kind::echo: return accept_echo(d, arrived);
    default: return;
    }
}

void Station::accept_request(const Decoded& d, Time arrived) noexcept {
    if (!core_.status.leading) return;
    followers_.calibrated(d.from, arrived);
    transmitter_.queue_reply(d, arrived);
}

void Station::accept_reply(const Decoded& d, Time arrived) noexcept {
    Status& status = core_.status;
    if (d.from != status.master) {
        ++status.count.foreign;
        return;
    }
    const std::uint32_t before = calibration_.done();
    const bool complete =
        calibration_.accept(d.reply, arrived, core_.clock.drift(), core_.setup.cycle / 4);
    if (complete || calibration_.done() != before) {
        ++status.count.replies;
    }
    if (!complete) return;
    uncalibrated_reported_ = false;
    transmitter_.recalibrate_every(0);
    core_.clock.delay_changed(calibration_.delay() - status.delay);
    status.delay = calibration_.delay();
    measured_ = d.from;
    measured_heard_ = sync_.cycle;
    status.calibrated = true;
    report(Event::calibrated, d.from, status.delay);
    if (status.state != State::calibrating) return;
    if (core_.setup.role == Role::master) {
        lead_wait_ = 2;
    }
    become(State::running);
}

/// The stamps are from the other station's clock: two of them give its drift.
void Station::accept_echo(const Decoded& d, Time arrived) noexcept {
    for (std::size_t n = 0; n < pings_.size(); ++n) {
        if (!pings_.accept(n, d.from, d.echo, arrived)) continue;
        if (core_.clock.known()) {
            slot_monitor_.stamp(n, d.echo.stamp, core_.clock.global(arrived));
        }
        return;
    }
    ++core_.status.count.foreign;
}

// Syncs.

/// Returns false for times outside a century, and for a sync sent in another cycle than its own.
bool Station::is_plausible(const Sync& s) const noexcept {
    constexpr Time century = 3'155'760'000'000'000'000;
    const Time lateness = lateness_of(s);
    return s.scheduled >= -century && s.scheduled <= century && lateness > -core_.setup.cycle &&
           lateness < core_.setup.cycle;
}

/// Returns true for a sync that is not newer than the last one.
bool Station::is_outdated(const Sync& s) const noexcept {
    if (core_.status.leading && core_.setup.role == Role::master) return false;
    return sync_.ever && static_cast<std::int32_t>(s.cycle - sync_.cycle) <= 0;
}

void Station::accept_sync(const Decoded& d, Time arrived, Time now) noexcept {
    const Sync& s = d.sync;
    Status& status = core_.status;
    if (!is_plausible(s)) {
        ++status.count.foreign;
        return;
    }
    if (!other_masters_.allows(d.from)) return;
    if (status.state == State::withdrawn) {
        status.master = d.from;
        unfit_sync_ = now;
        return other_masters_.refresh(d.from, now);
    }
    if (finds_master(d)) return withdraw(Event::master_there, d.from);
    if (status.state == State::listening) return listen_to(d, arrived, now);
    if (!core_.fits(s)) return accept_foreign_sync(d, arrived, now);
    if (is_beside_master(d, now)) {
        ++status.count.foreign;
        return;
    }
    if (is_outdated(s)) return;
    if (is_new_sender(d.from)) {
        if (status.leading) return;
        count_lost(s);
        return note_sync(s, arrived);
    }
    if (status.leading && !yields_to(d, arrived, now)) return;
    follow(d, arrived);
}

/// The syncs of a backup are delayed by its offset. Without a delay the sender is another master:
/// nothing to take over. Returns true when that is confirmed.
bool Station::finds_master(const Decoded& d) noexcept {
    if (core_.setup.role != Role::master || core_.status.leading) return false;
    if (!core_.is_from_master(lateness_of(d.sync))) {
        master_row_ = 0;
    } else if (d.from == master_) {
        ++master_row_;
    } else {
        master_row_ = 1;
    }
    master_ = d.from;
    return master_row_ >= confirmations;
}

/// Returns true for a sync with the number and time of the master's that another station sends while
/// the master is heard, and reports that one as a second master. The first one stays the master
/// until its syncs are lost.
bool Station::is_beside_master(const Decoded& d, Time now) noexcept {
    if (core_.status.leading) return false;
    const bool punctual = core_.is_from_master(lateness_of(d.sync));
    if (d.from == core_.status.master) {
        if (punctual) {
            parallel_master_.note_master(d.sync.cycle);
        } else {
            parallel_master_.note_backup();
        }
        return false;
    }
    if (!punctual) return false;
    const bool parallel = parallel_master_.note_other(d.from, d.sync.cycle);
    const bool is_known = other_masters_.present() && other_masters_.is(d.from);
    if (is_known || parallel_master_.confirmed()) {
        other_masters_.confirm(d.from, followers_, now);
    }
    return is_known || parallel;
}

/// A new sender is accepted after its second sync; until then its sync counts as received, so that
/// a backup's take-over is not a loss.
bool Station::is_new_sender(const Address& from) noexcept {
    if (from == core_.status.master && !core_.status.leading) {
        newcomer_.reset();
        return false;
    }
    return std::exchange(newcomer_, from) != from;
}

void Station::count_lost(const Sync& s) noexcept {
    if (sync_.ever) {
        core_.status.count.syncs_lost += s.cycle - sync_.cycle - 1;
    }
}

void Station::note_sync(const Sync& s, Time arrived) noexcept {
    sync_.ever = true;
    sync_.received = true;
    sync_.cycle = s.cycle;
    sync_.at = arrived;
}

/// Returns true when this station stops sending syncs for another one.
bool Station::yields_to(const Decoded& d, Time arrived, Time now) noexcept {
    const StationSetup& setup = core_.setup;
    const Time lateness = lateness_of(d.sync);
    if (setup.role == Role::master) {
        // A backup that missed a sync is harmless, a second master is not.
        if (core_.is_from_master(lateness)) {
            accept_foreign_sync(d, arrived, now);
        }
        return false;
    }
    const Time own = setup.role == Role::backup ? setup.backup_offset : 0;
    const Time apart =
        setup.backup_from != 0 ? std::min(setup.guard, setup.backup_from) : setup.guard;
    if (lateness >= own - apart / 2) return false;  // another backup with a larger offset
    core_.status.leading = false;
    report(Event::yielded, d.from);
    return true;
}

void Station::follow(const Decoded& d, Time arrived) noexcept {
    const Sync& s = d.sync;
    foreign_row_ = 0;
    count_lost(s);
    if (d.from != core_.status.master) {
        change_master(d);
    }
    if (d.from == measured_) {
        measured_heard_ = s.cycle;
    }
    note_sync(s, arrived);
    ++core_.status.count.syncs;
    core_.grid = {s.cycle, s.scheduled};
    core_.clock.accept(s.stamp, arrived, core_.status.delay);
}

void Station::change_master(const Decoded& d) noexcept {
    core_.status.master = d.from;
    parallel_master_.restart();
    calibration_.forget();
    core_.clock.another_master();
    report(Event::master_changed, d.from);
    // A master that was lost for a few cycles only is calibrated already.
    if (d.from == measured_ && d.sync.cycle - measured_heard_ <= max_return) {
        calibration_.end();
        transmitter_.recalibrate_every(0);
    } else if (core_.status.calibrated && !core_.setup.slots.empty()) {
        calibration_.begin(core_.setup.rounds);
        transmitter_.recalibrate_every(8);
    }
}

/// Adopts a schedule after three consistent syncs: a single frame may be anything.
void Station::listen_to(const Decoded& d, Time arrived, Time now) noexcept {
    const Sync& s = d.sync;
    const bool fits = core_.fits(s);
    const Claimant& c = other_masters_.claim(d, arrived);
    if (!fits) {
        unfit_sync_ = now;
    }
    if (c.confirmed() && std::abs(c.every - core_.setup.cycle) > core_.setup.cycle / 8) {
        ++core_.status.count.foreign;
        if (!std::exchange(schedule_reported_, true)) {
            report(Event::other_schedule, d.from, c.every);
        }
        return;
    }
    // of two masters, the first with three
    if (fits && s.cycle != sync_.cycle) {
        ++good_row_;
    } else {
        good_row_ = c.confirmed() ? confirmations : 1;
    }
    if (!fits) {
        core_.clock.clear();
    }
    core_.grid = {s.cycle, s.scheduled};
    core_.grid_known = true;
    core_.clock.accept(s.stamp, arrived, core_.status.delay);
    note_sync(s, arrived);
    core_.status.master = d.from;
    ++core_.status.count.syncs;
    if (good_row_ >= confirmations) {
        become(State::synchronising);
    }
}

/// Returns true when this station, which leads, ends a conflict with another schedule although it
/// had followers as that appeared: no station proves that it follows, or they follow the other one.
/// A backup gives way to a master, later a master to a backup, whose schedule it takes over.
bool Station::gives_way(bool to_master, Time now) const noexcept {
    if (followers_.proven(now, gone_after)) return false;
    if (core_.setup.role == Role::backup) return to_master && other_masters_.lasts(now, gone_after);
    return !to_master && other_masters_.lasts(now, 2 * gone_after);
}

/// Handles a sync of another schedule.
void Station::accept_foreign_sync(const Decoded& d, Time arrived, Time now) noexcept {
    Status& status = core_.status;
    ++status.count.foreign;
    const bool is_master = !status.leading && d.from == status.master;
    if (is_master && ++foreign_row_ >= confirmations) {  // it restarted with a new schedule
        report(Event::new_schedule, d.from);
        ++status.count.losses;
        return begin();
    }
    if (!other_masters_.claim(d, arrived).confirmed() || is_master) return;
    other_masters_.confirm(d.from, followers_, now);
    if (!status.leading) return;
    const bool from_master = core_.is_from_master(lateness_of(d.sync));
    // a schedule with followers is kept
    if (other_masters_.established() && !gives_way(from_master, now)) return;
    if (core_.setup.role == Role::master && from_master) {
        if (d.from < core_.address) {
            unfit_sync_ = now;
            withdraw(Event::withdrew, d.from);
        }
        return;
    }
    // A backup yields to a master; a master that finds a backup's schedule listens and takes that
    // over.
    if (core_.setup.role == Role::master || from_master) {
        report(Event::yielded, d.from);
        begin_at(now);
        unfit_sync_ = now;
    }
}

void Station::withdraw(Event why, const Address& who) noexcept {
    core_.status.leading = core_.status.synchronous = false;
    core_.status.master = who;
    become(State::withdrawn);
    report(why, who);
}

// Once a cycle.

/// Determines the cycle number and the phase error of the thread.
void Station::advance(Time now) noexcept {
    Status& status = core_.status;
    const StationSetup& setup = core_.setup;
    status.drift = core_.clock.drift();
    status.jitter = core_.clock.jitter();
    if (status.leading) {
        core_.clock.decay(now);
    }
    if (!core_.grid_known || !core_.clock.known()) {
        status.error = 0;
        return;
    }
    status.global = core_.clock.global(now);
    status.offset = status.global - now;
    const Time into = status.global - setup.phase - core_.grid.start + setup.cycle / 2;
    const Time cycles = core_.cycles_in(into);
    core_.grid.number += static_cast<std::uint32_t>(cycles);
    core_.grid.start += cycles * setup.cycle;
    if (core_.own_schedule) {
        core_.grid.start = status.global - setup.phase;  // its thread defines the schedule
    }
    status.cycle = core_.grid.number;
    status.error = core_.clock.local(core_.grid.start + setup.phase) - now;
}

void Station::start_leading(Time now) noexcept {
    Status& status = core_.status;
    const bool first = !core_.clock.known();
    core_.clock.lead(now);
    if (first) {
        core_.own_schedule = core_.grid_known = true;
        core_.grid = {0, now - core_.setup.phase};
        status.calibrated = true;  // its clock is the global time
    }
    status.leading = status.synchronous = true;
    status.master = core_.address;
    ++status.count.take_overs;
    report(Event::leading, core_.address);
    if (status.state != State::running) {
        become(State::running);
    }
}

bool Station::may_lead() const noexcept {
    const StationSetup& setup = core_.setup;
    if (setup.role != Role::backup || core_.status.state != State::running || !sync_.ever) {
        return false;
    }
    // With a phase the thread runs after the sync of its cycle; without one the newest possible
    // sync is that of the last cycle. The same holds for a thread that cannot come into phase, of a
    // second station in the process, and runs too early by more than the guard.
    const bool after_sync = setup.phase > 0 && core_.status.error <= setup.guard;
    const std::uint32_t newest = after_sync ? core_.grid.number : core_.grid.number - 1;
    return static_cast<std::int32_t>(newest - sync_.cycle) > 0;
}

void Station::count_silence() noexcept {
    Status& status = core_.status;
    const auto unheard =
        sync_.ever ? static_cast<std::int32_t>(core_.grid.number - 1 - sync_.cycle) : 0;
    const bool silent = !status.leading && unheard > 0;
    status.silent_cycles = silent ? static_cast<std::uint32_t>(unheard) : 0;
    status.master_active = status.leading || (sync_.ever && !silent);
}

void Station::update_state(Time now) noexcept {
    switch (core_.status.state) {
    case State::listening: return listen(now);
    case State::withdrawn:
        if (now - unfit_sync_ > gone_after) {
            begin_at(now);
        }
        return;
    case State::unconfigured: return;
    case State::synchronising: synchronise(); break;
    case State::calibrating: watch_calibration(); break;
    case State::running: run(now); break;
    }
    core_.status.count.unanswered = calibration_.unanswered();
    check_loss(now);
}

bool Station::may_lead_after_listening(Time now) const noexcept {
    if (core_.setup.role != Role::master || sync_.received) return false;
    const Time listening = core_.setup.listen_cycles * core_.setup.cycle;
    if (now - began_ < std::max<Time>(listening, min_listening)) return false;
    if (sync_.ever && now - sync_.at <= listening) return false;
    return unfit_sync_ == 0 || now - unfit_sync_ > unfit_for;
}

void Station::listen(Time now) noexcept {
    if (may_lead_after_listening(now)) {
        core_.clock.clear();
        core_.grid_known = false;
        start_leading(now);
        advance(now);
    } else if (core_.status.count.syncs == 0 && now - began_ > unheard_after &&
               !std::exchange(unheard_reported_, true)) {
        report(Event::unheard);
    }
}

void Station::synchronise() noexcept {
    Status& status = core_.status;
    const Time error = std::abs(status.error);
    if (core_.clock.settled() && error < core_.setup.cycle / 16) {
        status.synchronous = true;
        report(Event::synchronised, status.master);
        return become(core_.setup.slots.empty() ? State::running : State::calibrating);
    }
    const auto limit = static_cast<std::uint32_t>(out_of_step_after / core_.setup.cycle);
    if (++out_of_step_ == limit && error != 0) {
        report(Event::out_of_step, status.master, error);
    }
}

void Station::watch_calibration() noexcept {
    const std::uint32_t unanswered = calibration_.unanswered_row();
    if (unanswered >= max_unanswered && !std::exchange(uncalibrated_reported_, true)) {
        report(Event::uncalibrated, core_.status.master, unanswered);
    }
}

void Station::run(Time now) noexcept {
    if (lead_wait_ != 0) {
        --lead_wait_;
    }
    if (core_.status.leading) return;
    const bool returns = core_.setup.role == Role::master && lead_wait_ == 0;
    if (returns || may_lead()) {
        start_leading(now);
    }
}

void Station::check_loss(Time now) noexcept {
    Status& status = core_.status;
    if (status.leading || status.silent_cycles < core_.setup.lost_limit) return;
    ++status.count.losses;
    status.count.syncs_lost += status.silent_cycles;
    const Address master = status.master;
    const Time since = (now - sync_.at + 50'000) / 100'000 * 100'000;
    restart();
    began_ = now;
    report(Event::sync_lost, master, since);
}

void Station::transmit(Time now) noexcept {
    if (core_.port == nullptr || !core_.grid_known || !core_.clock.settled()) return;
    const State state = core_.status.state;
    if (state != State::calibrating && state != State::running) return;
    if (state == State::running) {
        for (Companion* companion : {rtcfg_, tunnel_}) {
            if (companion != nullptr) {
                companion->before_slots(now);
            }
        }
    }
    // A backup decides in the cycle itself, when the sync has not come.
    const bool backup_sync = core_.status.leading && may_lead();
    transmitter_.transmit(now, backup_sync);
}

}  // namespace hal::tdma
