// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>

#include "link/timing.hpp"
#include "station.hpp"

namespace hal::scocan {

namespace {
// intervals in a row, until the rate is reported: one may be that of a disturbed SYNC
constexpr std::uint32_t most_off_rate = 3;
}  // namespace

const char* to_string(State state) noexcept {
    constexpr const char* words[] = {"listening",   "running",  "silent",
                                     "listen-only", "silenced", "down"};
    return words[static_cast<std::size_t>(state)];
}

Station::Station(const Table& table, std::size_t node, const StationOptions& options, Sink& sink)
    : table_(table),
      node_(node),
      role_(table.nodes[node].role),
      backup_(table.nodes[node].backup),
      senses_(table.nodes[node].senses),
      single_shot_(options.single_shot),
      wants_windows_(options.windows),
      sink_(sink),
      crystal_(options.crystal),
      clock_(table.cycle, table.bits(4) + options.crystal.tick) {}

void Station::attach(can::Link& link) noexcept {
    link_ = &link;
    windows_ = wants_windows_ && link.description().has_windows;
    timed_ = link.description().bit_rate != 0;
    silenced_ = listen_only_ = was_down_ = monitor_lost_ = false;
    mode_ = offences_ = 0;
    not_allowed_.fill(false);
    forget();
}

/// Forgets the bus: everything that came from it or goes to it.
void Station::forget() noexcept {
    clock_.clear();
    queue_.clear();
    state_ = State::listening;
    mode_unknown_ = was_silent_ = false;
    numbered_ = leading_ = standby_ = monitored_ = false;
    armed_ = {};
    change_ = {};
    counter_ = unannounced_cycles_ = off_rate_ = 0;
    first_seen_ = last_begin_ = INT64_MIN;
    announced_slot_ = no_slot;
    leader_ = no_node;
    values_.fill({});
    last_call_ = INT64_MIN;
}

void Station::restart(Time now) noexcept {
    constexpr std::size_t max_rounds = 512;
    if (link_ == nullptr) return;
    for (std::size_t round = 0; round < max_rounds; ++round) {
        if (link_->receive(frames_, now) < frames_.size()) break;
    }
    if (is_sync_node()) {
        listen_only_ = false;  // whether the tables differ is found out anew
    }
    forget();
}

void Station::receive(Time now) noexcept {
    if (link_ == nullptr) return;
    now_ = now;
    if (first_seen_ == INT64_MIN) {
        first_seen_ = crystal_.epoch = now;
        first_seen_ = crystal_.local(now);
    }
    // bounded: a babbling bus must not stop the thread
    for (std::size_t round = 0; round < 16; ++round) {
        const auto count = link_->receive(frames_, now);
        for (std::size_t i = 0; i < count; ++i) {
            arrived(frames_[i]);
        }
        if (count < frames_.size()) break;
    }
    const Time local = crystal_.local(now);
    // The SYNC is lost when even that of the last backup would have arrived.
    if (const auto passed = clock_.pass(local, table_.slot()); passed != 0) {
        counter_ = (counter_ + passed) % counter_cycles;
        count_.syncs_lost += passed;
        close_cycle();
        switch_mode();
        change_cycle();
    }
    if (const auto missed = queue_.expire(local); missed != 0) {
        count_.missed += missed;
    }
    judge(local);
}

void Station::arrived(const can::Frame& frame) noexcept {
    if (frame.error || frame.extended || frame.fd) return;
    const Time length =
        timed_ ? table_.bits(can::frame_bits(frame).nominal - can::intermission_bits) : 0;
    const Time bus_begin = frame.time_ns - length;

    const Time begin =
        crystal_.stamp(frame.time_ns) - (crystal_.local(frame.time_ns) - crystal_.local(bus_begin));
    last_begin_ = std::max(last_begin_, begin);
    if (frame.id == sync_id) return sync(frame, begin);
    const Where w = where(begin);
    if (frame.own) return echo(frame, w, bus_begin);
    watch(frame, w, begin);
    if (std::uint32_t slot = 0; decode_announcement(frame, slot)) {
        if (!w.known || w.slot != slot) return;
        announced_slot_ = slot;
        announced_cycle_ = w.cycle;
        ++count_.announced;
        if (slot < told_.size()) {
            told_[slot] = true;
        }
        if (monitor_lost_) {
            raise(Event::monitor_found);
        }
        monitored_ = true;
        monitor_lost_ = false;
        unannounced_cycles_ = 0;
        return;
    }
    if (frame.id >= request_id) {
        configuration(frame);
    }
    ++count_.received;
    sink_.on_frame(frame, bus_begin);
}

/// Handles a SYNC, of others or the echo of an own one.
void Station::sync(const can::Frame& frame, Time begin) noexcept {
    if (frame.own) return sync_sent(begin);
    Sync s;
    if (!decode(frame, s)) return void(++count_.syncs_ignored);
    const bool led = leading_;
    if (is_sync_node()) {
        other_sync(s);
    }
    if (leading_) return;
    const Time stamp = begin - table_.sync_offset(s.sender);
    const std::uint64_t before = clock_.cycle();
    const bool was_known = clock_.known();
    switch (clock_.take(stamp)) {
    case CycleClock::Taken::first: numbered_ = false; break;
    case CycleClock::Taken::good: off_rate_ = 0; break;
    case CycleClock::Taken::off_rate:
        ++count_.syncs_ignored;
        numbered_ = false;
        if (++off_rate_ >= most_off_rate) {
            raise(Event::sync_off_rate, no_node, 0, std::llround(clock_.off_ppm()));
        }
        return;
    case CycleClock::Taken::rejected:
        ++count_.syncs_ignored;
        return raise(Event::sync_late, no_node, 0, std::llround(clock_.error()));
    case CycleClock::Taken::duplicate:
        ++count_.syncs_ignored;
        return led ? void() : raise(Event::sync_doubled);  // led: the first one was its own
    case CycleClock::Taken::jumped: raise(Event::sync_jumped); break;
    }
    ++count_.syncs;
    leader_ = s.sender;
    const auto passed = clock_.cycle() - before;
    if (passed > 1 && was_known) {
        count_.syncs_lost += passed - 1;
    }
    counter_ =
        s.numbered ? s.counter : static_cast<std::uint32_t>(counter_ + passed) % counter_cycles;
    numbered_ = s.numbered;
    close_cycle();
    if (s.pending && armed_.prepared) {
        armed_.confirmed = true;
    }
    switch_mode();
    if (s.numbered && s.mode != mode_) {
        const bool unknown = !table_.has_mode(s.mode);
        if (unknown && !mode_unknown_) {
            raise(Event::unknown_mode, no_node, 0, s.mode);
        }
        mode_unknown_ = unknown;
        if (!unknown) {
            mode_ = s.mode;
            armed_ = {};
            ++count_.mode_changes;

            raise(Event::mode_changed, no_node, 0, mode_);
        }
    } else {
        mode_unknown_ = false;
    }
    change_cycle();
}

/// Notes that an own frame was sent.
void Station::echo(const can::Frame& frame, const Where& w, Time bus_begin) noexcept {
    if (frame.id == announce_id) {
        ++count_.announced;
        if (w.slot < told_.size()) {
            told_[w.slot] = true;
        }
        announced_slot_ = w.slot;
        announced_cycle_ = w.cycle;
        return;
    }
    if (w.known) {
        seen_[w.slot] = true;
    }
    SendQueue::Entry sent;
    const bool known = queue_.confirm(frame, sent);
    const Use* use = w.known ? table_.use(mode_of(w.cycle), w.slot, w.counter) : nullptr;
    if (use == nullptr || use->kind == Kind::shared) {
        ++count_.sent_shared;
    } else if (use->kind == Kind::priv && use->node == node_) {
        ++count_.sent_private;
    } else {
        ++count_.sent_recycled;
    }
    if (w.known && state_ == State::running) {
        const bool mine = use != nullptr && use->kind == Kind::priv && use->node == node_ &&
                          use->carries(frame.id);
        const Time late = w.offset - table_.enabled() - table_.guard;
        if (mine && late > 0 && single_shot_) {
            ++count_.late;
            raise(Event::late_frame, static_cast<std::uint32_t>(node_), frame.id, late);
            offend(crystal_.local(bus_begin));
        } else if (!mine && is_foreign(frame, w)) {
            ++count_.late;
            raise(Event::foreign_frame, static_cast<std::uint32_t>(node_), frame.id, w.slot);
            offend(crystal_.local(bus_begin));
        }
    }
    if (known || frame.id < request_id) {
        sink_.on_sent(frame, bus_begin);
    }
}

Station::Where Station::where(Time local) const noexcept {
    Where w;
    if (!clock_.known()) return w;
    const Time slack = table_.guard / 2;
    const double behind = static_cast<double>(local - clock_.start() + slack) / clock_.period();
    if (!(behind > -4 && behind < 1e6)) return w;
    auto cycles = static_cast<std::int64_t>(behind);
    if (behind < static_cast<double>(cycles)) {
        --cycles;
    }
    w.known = true;
    w.cycle = clock_.cycle() + static_cast<std::uint64_t>(cycles);
    w.counter = counter_of(w.cycle);
    const auto slot =
        static_cast<std::uint32_t>((behind - static_cast<double>(cycles)) * table_.slots);
    w.slot = std::min(slot, table_.slots - 1);
    w.offset = local - begin_of(w.cycle, w.slot);
    return w;
}

/// Derives the state from what is known by now.
void Station::judge(Time now) noexcept {
    const can::State controller = link_->state();
    const bool down = controller == can::State::bus_off || controller == can::State::down;
    if (down != was_down_) {
        was_down_ = down;
        raise(down ? Event::bus_off : Event::bus_on);
    }
    const Time age = std::max<Time>(now - clock_.start(), 0) + table_.cycle * clock_.lost();
    const bool silent =
        clock_.known() && !leading_ &&
        (clock_.lost() > table_.lost || table_.required_guard(age) > table_.guard + table_.bits(1));
    if (silent) {
        clock_.accept_any_phase();
    }
    if (silent && !was_silent_) {
        ++count_.losses;
        raise(Event::sync_lost, no_node, 0, clock_.lost());
    }
    was_silent_ = silent;
    const State before = state_;
    if (down) {
        state_ = State::down;
    } else if (silenced_) {
        state_ = State::silenced;
    } else if (listen_only_ || mode_unknown_) {
        state_ = State::listen_only;
    } else if (!clock_.known()) {
        state_ = State::listening;
    } else if (silent) {
        state_ = State::silent;
    } else {
        state_ = State::running;
    }
    if (state_ == State::running && before != State::running) {
        raise(Event::running);
    }
}

}  // namespace hal::scocan
