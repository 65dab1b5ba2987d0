// SPDX-License-Identifier: MIT
// Received frames, and missing ones.
#include <algorithm>
#include <cstdlib>
#include <utility>

#include "station.hpp"

namespace hal::tdma {

namespace {

// in a cycle: a babbling station must not hold the thread
constexpr std::size_t most_arrivals = 1024;
// cycles after which a returning master needs a new calibration
constexpr std::uint32_t soon_back = 100;
// delay of a master after another one's sync
constexpr Time unfit_for = 100'000'000;
constexpr Time too_long_unheard = 5'000'000'000;
// coming into phase takes a fraction of this
constexpr Time too_long_out = 5'000'000'000;

}  // namespace

void Station::receive(Time now) noexcept {
    thread_.store(pthread_self(), std::memory_order_relaxed);
    if (port_ == nullptr) return;
    const Time absence = now - std::exchange(last_cycle_, now);
    const Time max_pause = std::max<Time>(max_absence, setup_.lost_limit * setup_.cycle);
    if (status_.leading && absence > max_pause) {
        restart();
    }
    const bool first = began_ == 0;
    if (first) {
        began_ = now;
    }
    heard_ = false;
    check_carrier(now);
    for (std::size_t i = 0; i < most_arrivals; ++i) {
        const auto arrival = port_->receive(now);
        if (!arrival) break;
        // received before the thread's first cycle
        if (first && arrival->time_ns < now - setup_.cycle) continue;
        take(*arrival, now);
    }
    for (std::uint32_t* gap :
         {&foreign_gap_, &intruder_gap_, &babble_gap_, &unknown_gap_, &duplicate_gap_}) {
        if (*gap != 0) {
            --*gap;
        }
    }
    std::uint32_t frames = 0;
    if (const Address* who = babble_monitor_.babbler(limit_, frames);
        who != nullptr && babble_gap_ == 0) {
        babble_gap_ = silence_after;
        report(Event::babbling, *who, frames);
    }
    roster_.expire(now, gone_after);
    pings_.expire(now, std::max(Pings::timeout, 20 * setup_.cycle),
                  status_.state == State::running);
    advance(now);
    count_silence(now);
}

void Station::take(const ethernet::Arrival& arrival, Time now) noexcept {
    const auto frame = arrival.bytes;
    if (frame.size() < ethernet::header_bytes) {
        ++status_.count.foreign;
        return;
    }
    Decoded d = decode(frame);
    if (d.from == address_) return;
    babble_monitor_.heard(d.from, arrival.time_ns, setup_.cycle);
    if (rtcfg_ != nullptr) {
        rtcfg_->heard(d.from, now);
    }
    if (status_.state == State::unconfigured && d.kind != Kind::none) return;
    if (roster_.size() != 0) {
        note(d, arrival.time_ns, frame.size(), now);
    }
    if (d.kind != Kind::sync && d.kind != Kind::request && d.from != other_) {
        followers_.sent(d.from, now);
    }
    switch (d.kind) {
    case Kind::sync: take_sync(d, arrival.time_ns, now); return;
    case Kind::request:
        check_slot(frame, d.from, arrival.time_ns);
        if (d.to == address_) {
            take_request(d, arrival.time_ns);
        }
        return;
    case Kind::reply:  // in the requester's slot
        if (d.to == address_) {
            take_reply(d, arrival.time_ns, now);
        }
        return;
    case Kind::ping:
        check_slot(frame, d.from, arrival.time_ns);
        if (d.to == address_ && status_.state == State::running) {
            pings_.queue_answer({d.from, d.ping.stamp, arrival.time_ns, d.ping.number});
        }
        return;
    case Kind::echo:
        check_slot(frame, d.from, arrival.time_ns);
        if (d.to == address_) {
            take_echo(d, arrival.time_ns);
        }
        return;
    case Kind::tunnelled:
        check_slot(frame, d.from, arrival.time_ns);
        if (tunnel_ != nullptr) {
            tunnel_->arrived(frame, now);
        }
        return;
    case Kind::none: break;
    }
    if (d.defect != Defect::ethertype) {
        ++status_.count.foreign;
        return;
    }
    check_slot(frame, d.from, arrival.time_ns);
    if (rtcfg_ != nullptr && frame[12] == rtcfg_type >> 8 && frame[13] == (rtcfg_type & 0xff)) {
        rtcfg_->arrived(frame, now);
    }
}

void Station::take_sync(const Decoded& d, Time arrived, Time now) noexcept {
    const Sync& s = d.sync;
    const Time lateness = static_cast<Time>(static_cast<std::uint64_t>(s.stamp) -
                                            static_cast<std::uint64_t>(s.scheduled));
    // Ignores times outside a century, and a sync sent in another cycle than its own.
    constexpr Time century = 3'155'760'000'000'000'000;
    if (s.scheduled < -century || s.scheduled > century || lateness <= -setup_.cycle ||
        lateness >= setup_.cycle) {
        ++status_.count.foreign;
        return;
    }
    if (!is_allowed(d.from)) return;
    if (status_.state == State::withdrawn) {
        status_.master = d.from;
        unfit_sync_ = now;
        if (other_heard_ != 0 && d.from == other_) {
            other_heard_ = now;
        }
        return;
    }
    if (setup_.role == Role::master && !status_.leading) {
        // The syncs of a backup are delayed by its offset. Without a delay the sender is another
        // master: nothing to take over.
        if (!is_from_master(lateness)) {
            master_row_ = 0;
        } else if (d.from == master_) {
            master_row_ = master_row_ + 1;
        } else {
            master_row_ = 1;
        }
        master_ = d.from;
        if (master_row_ >= rows) return withdraw(Event::master_there, d.from);
    }
    if (status_.state == State::listening) return listen_to(d, arrived, now);
    const bool fits = based_ && std::abs(s.scheduled - start_of(s.cycle)) <= setup_.cycle / 8;
    if (!fits) return take_foreign_sync(d, now);
    if (heard_ever_ && static_cast<std::int32_t>(s.cycle - heard_cycle_) <= 0 &&
        !(status_.leading && setup_.role == Role::master)) {
        return;
    }
    // A new sender is accepted after its second sync; until then its sync counts as received, so
    // that a backup's take-over is not a loss.
    if (d.from != status_.master || status_.leading) {
        const bool again = d.from == newcomer_ && newcomer_row_ != 0;
        newcomer_ = d.from;
        newcomer_row_ = 1;
        if (!again) {
            if (status_.leading) return;
            if (heard_ever_) {
                status_.count.syncs_lost += s.cycle - heard_cycle_ - 1;
            }
            heard_cycle_ = s.cycle;
            heard_ = heard_ever_ = true;
            last_sync_ = arrived;
            return;
        }
    } else {
        newcomer_row_ = 0;
    }
    if (status_.leading) {
        const Time own = setup_.role == Role::backup ? setup_.backup_offset : 0;
        if (setup_.role == Role::master) {
            // A backup that missed a sync is harmless, a second master is not.
            if (!is_from_master(lateness)) return;
            return take_foreign_sync(d, now);
        }
        const Time apart =
            setup_.backup_from != 0 ? std::min(setup_.guard, setup_.backup_from) : setup_.guard;
        if (lateness >= own - apart / 2) {
            return;  // another backup with a larger offset
        }
        status_.leading = false;
        report(Event::yielded, d.from);
    }
    foreign_row_ = 0;
    if (heard_ever_) {
        status_.count.syncs_lost += s.cycle - heard_cycle_ - 1;
    }
    if (d.from != status_.master) {
        status_.master = d.from;
        calibration_.forget();
        clock_.another_master();
        report(Event::master_changed, d.from);
        // A master that was lost for a few cycles only is calibrated already.
        if (d.from == measured_ && s.cycle - measured_heard_ <= soon_back) {
            calibration_.end();
            recalibration_ = 0;
        } else if (status_.calibrated && !setup_.slots.empty()) {
            calibration_.begin(setup_.rounds);
            recalibration_ = 8;
        }
    }
    if (d.from == measured_) {
        measured_heard_ = s.cycle;
    }
    heard_cycle_ = s.cycle;
    heard_ = heard_ever_ = true;
    last_sync_ = arrived;
    ++status_.count.syncs;
    number_ = s.cycle;
    start_ = s.scheduled;
    clock_.take(s.stamp, arrived, status_.delay);
}

/// Adopts a schedule after three consistent syncs: a single frame may be anything.
void Station::listen_to(const Decoded& d, Time arrived, Time now) noexcept {
    const Sync& s = d.sync;
    const bool fits = based_ && std::abs(s.scheduled - start_of(s.cycle)) <= setup_.cycle / 8;
    const Claimant& c = claim(d);
    if (!fits) {
        unfit_sync_ = now;
    }
    if (c.row >= rows && std::abs(c.every - setup_.cycle) > setup_.cycle / 8) {
        ++status_.count.foreign;
        if (!schedule_reported_) {
            report(Event::other_schedule, d.from, c.every);
        }
        schedule_reported_ = true;
        return;
    }
    // of two masters, the first with three
    if (fits && s.cycle != heard_cycle_) {
        good_row_ = good_row_ + 1;
    } else if (c.row >= rows) {
        good_row_ = rows;
    } else {
        good_row_ = 1;
    }
    if (!fits) {
        clock_.clear();
    }
    number_ = s.cycle;
    start_ = s.scheduled;
    based_ = true;
    clock_.take(s.stamp, arrived, status_.delay);
    heard_cycle_ = s.cycle;
    heard_ever_ = heard_ = true;
    last_sync_ = arrived;
    status_.master = d.from;
    ++status_.count.syncs;
    if (good_row_ >= rows) {
        become(State::synchronising, now);
    }
}

void Station::take_request(const Decoded& d, Time arrived) noexcept {
    if (!status_.leading) return;
    followers_.calibrated(d.from, arrived);
    const Request& r = d.request;
    const auto ahead = static_cast<std::int32_t>(r.reply_cycle - number_);
    if (r.reply_offset < 0 || r.reply_offset >= setup_.cycle || ahead < 0 || ahead > 100'000) {
        ++status_.count.too_late;
        return;
    }
    Pending* place = nullptr;
    for (Pending& p : pending_) {  // one per station
        if (p.used && p.to == d.from) {
            place = &p;
            break;
        }
        if (!p.used && place == nullptr) {
            place = &p;
        }
    }
    if (place == nullptr) {
        ++status_.count.too_late;
        return;
    }
    *place = {d.from, r.stamp, clock_.global(arrived), r.reply_offset, r.reply_cycle, true};
}

void Station::take_reply(const Decoded& d, Time arrived, Time now) noexcept {
    if (d.from != status_.master) {
        ++status_.count.foreign;
        return;
    }
    const std::uint32_t before = calibration_.done();
    const bool complete = calibration_.take(d.reply, arrived, clock_.drift(), setup_.cycle / 4);
    if (complete || calibration_.done() != before) {
        ++status_.count.replies;
    }
    if (!complete) return;
    uncalibrated_reported_ = false;
    recalibration_ = 0;
    clock_.delay_changed(calibration_.delay() - status_.delay);
    status_.delay = calibration_.delay();
    measured_ = d.from;
    measured_heard_ = heard_cycle_;
    status_.calibrated = true;
    report(Event::calibrated, d.from, status_.delay);
    if (status_.state == State::calibrating) {
        if (setup_.role == Role::master) {
            lead_wait_ = 2;
        }
        become(State::running, now);
    }
}

/// Determines the cycle number and the phase error of the thread.
void Station::advance(Time now) noexcept {
    status_.drift = clock_.drift();
    status_.jitter = clock_.jitter();
    if (status_.leading) {
        clock_.decay(now);
    }
    if (!based_ || !clock_.known()) {
        status_.error = 0;
        return;
    }
    status_.global = clock_.global(now);
    status_.offset = status_.global - now;
    const Time into = status_.global - setup_.phase - start_ + setup_.cycle / 2;
    const Time cycles =
        into >= 0 ? into / setup_.cycle : -((-into + setup_.cycle - 1) / setup_.cycle);
    number_ += static_cast<std::uint32_t>(cycles);
    start_ += cycles * setup_.cycle;
    if (own_schedule_) {
        start_ = status_.global - setup_.phase;  // its thread defines the schedule
    }
    status_.cycle = number_;
    status_.error = clock_.local(start_ + setup_.phase) - now;
}

void Station::start_leading(Time now) noexcept {
    if (!clock_.known()) {
        clock_.lead(now);
        own_schedule_ = based_ = true;
        number_ = 0;
        start_ = now - setup_.phase;
        status_.calibrated = true;  // its clock is the global time
    } else {
        clock_.lead(now);
    }
    status_.leading = status_.synchronous = true;
    status_.master = address_;
    ++status_.count.take_overs;
    report(Event::leading, address_);
    if (status_.state != State::running) {
        become(State::running, now);
    }
}

bool Station::may_lead() const noexcept {
    if (setup_.role != Role::backup || status_.state != State::running || !heard_ever_) {
        return false;
    }
    // With a phase the thread runs after the sync of its cycle; without one the newest possible
    // sync is that of the last cycle. The same holds for a thread that cannot come into phase, of a
    // second station in the process, and runs too early by more than the guard.
    const std::uint32_t newest =
        setup_.phase > 0 && status_.error <= setup_.guard ? number_ : number_ - 1;
    return static_cast<std::int32_t>(newest - heard_cycle_) > 0;
}

void Station::count_silence(Time now) noexcept {
    const auto unheard = heard_ever_ ? static_cast<std::int32_t>(number_ - 1 - heard_cycle_) : 0;
    status_.silent_cycles =
        status_.leading || unheard < 0 ? 0 : static_cast<std::uint32_t>(unheard);
    if (other_heard_ != 0 && now - other_heard_ > gone_after) {
        other_heard_ = 0;
        if (other_reported_) {
            report(Event::other_master_gone, other_);
        }
        other_reported_ = false;
    }
    status_.master_active = status_.leading || (heard_ever_ && status_.silent_cycles == 0);
    switch (status_.state) {
    case State::listening:
        if (setup_.role == Role::master && !heard_ &&
            now - began_ >= std::max<Time>(setup_.listen_cycles * setup_.cycle, 3'000'000) &&
            (!heard_ever_ || now - last_sync_ > setup_.listen_cycles * setup_.cycle) &&
            (unfit_sync_ == 0 || now - unfit_sync_ > unfit_for)) {
            clock_.clear();
            based_ = false;
            start_leading(now);
            advance(now);
        } else if (!unheard_reported_ && status_.count.syncs == 0 &&
                   now - began_ > too_long_unheard) {
            unheard_reported_ = true;
            report(Event::unheard);
        }
        return;
    case State::withdrawn:
        if (now - unfit_sync_ > gone_after) {
            begin();
            began_ = now;
        }
        return;
    case State::unconfigured: return;
    case State::synchronising:
        if (clock_.settled() && std::abs(status_.error) < setup_.cycle / 16) {
            status_.synchronous = true;
            report(Event::synchronised, status_.master);
            become(setup_.slots.empty() ? State::running : State::calibrating, now);
        } else if (++out_of_step_ == static_cast<std::uint32_t>(too_long_out / setup_.cycle) &&
                   status_.error != 0) {
            report(Event::out_of_step, status_.master, std::abs(status_.error));
        }
        break;
    case State::calibrating:
        if (calibration_.unanswered_row() >= 20 && !uncalibrated_reported_) {
            uncalibrated_reported_ = true;
            report(Event::uncalibrated, status_.master, calibration_.unanswered_row());
        }
        break;
    case State::running:
        if (lead_wait_ != 0) {
            --lead_wait_;
        }
        if (setup_.role == Role::master && !status_.leading && lead_wait_ == 0) {
            start_leading(now);
        }
        if (may_lead() && !status_.leading) {
            start_leading(now);
        }
        break;
    }
    status_.count.unanswered = calibration_.unanswered();
    if (!status_.leading && status_.silent_cycles >= setup_.lost_limit) {
        ++status_.count.losses;
        status_.count.syncs_lost += status_.silent_cycles;
        const Address master = status_.master;
        const Time since = (now - last_sync_ + 50'000) / 100'000 * 100'000;
        restart();
        began_ = now;
        report(Event::sync_lost, master, since);
    }
}

}  // namespace hal::tdma
