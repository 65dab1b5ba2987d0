// SPDX-License-Identifier: MIT
#include "fieldbus/scocan/station/station.hpp"

#include <algorithm>
#include <cmath>

#include "link/timing.hpp"

namespace hal::scocan {

namespace {
// intervals in a row, until the rate is reported: one may be that of a disturbed SYNC
constexpr std::uint32_t max_off_rate = 3;
// bounded: a babbling bus must not stop the thread
constexpr std::size_t max_rounds = 16;
constexpr std::size_t max_rounds_of_restart = 512;
}  // namespace

const char* to_string(State state) noexcept {
    constexpr const char* names[] = {"listening",   "running",  "silent",
                                     "listen-only", "silenced", "down"};
    return names[static_cast<std::size_t>(state)];
}

Station::Station(const Table& table, std::size_t node, const StationOptions& options,
                 Events& events)
    : core_(table, node, options, events), wants_windows_(options.windows) {}

void Station::attach(can::Link& link) noexcept {
    core_.link = &link;
    core_.windows = wants_windows_ && link.description().has_windows;
    timed_ = link.description().bit_rate != 0;
    core_.silenced = core_.listen_only = was_down_ = false;
    modes_.attach();
    slot_monitor_.attach();
    transmitter_.attach();
    core_.count.dropped += core_.queue.size();
    core_.queue.clear();
    forget();
}

/// Forgets the bus: everything that came from it or goes to it, except frames on the link, whose
/// echo decides whether they were sent.
void Station::forget() noexcept {
    core_.clock.clear();
    core_.count.dropped += core_.queue.drop_waiting(UINT32_MAX);
    core_.state = State::listening;
    core_.numbered = core_.leading = was_silent_ = false;
    core_.counter = off_rate_ = 0;
    core_.first_seen = core_.last_begin = INT64_MIN;
    modes_.forget();
    slot_monitor_.forget();
    sync_.forget();
    transmitter_.forget();
}

void Station::restart(Time now) noexcept {
    if (core_.link == nullptr) return;
    for (std::size_t round = 0; round < max_rounds_of_restart; ++round) {
        const auto count = core_.link->receive(frames_, now);
        for (std::size_t i = 0; i < count; ++i) {
            confirm_old_echo(frames_[i]);
        }
        if (count < frames_.size()) break;
    }
    if (core_.is_sync_node()) {
        core_.listen_only = false;  // whether the tables differ is found out anew
    }
    forget();
}

/// A frame that was on the link when the thread was stopped has been sent, and is not dropped.
void Station::confirm_old_echo(const can::Frame& frame) noexcept {
    SendQueue::Entry sent;
    if (frame.own && core_.queue.confirm(frame, sent)) {
        core_.events.on_sent(frame, frame.time_ns);
    }
}

void Station::reset() noexcept {
    core_.silenced = false;
    slot_monitor_.reset();
    sync_.reset();
}

bool Station::request_silence(std::uint32_t node, bool silent) noexcept {
    if (core_.role != Role::monitor || node >= core_.table.nodes.size() || node == core_.node) {
        return false;
    }
    const auto what = silent ? Request::What::silence : Request::What::resume;
    const Request request{core_.node, what, static_cast<std::uint8_t>(node), core_.table.crc, 0};
    return core_.queue.push(encode(request), no_slot, false, false);
}

void Station::receive(Time now) noexcept {
    if (core_.link == nullptr) return;
    core_.now = now;
    if (core_.first_seen == INT64_MIN) {
        core_.crystal.epoch = now;
        core_.first_seen = core_.crystal.local(now);
    }
    for (std::size_t round = 0; round < max_rounds; ++round) {
        const auto count = core_.link->receive(frames_, now);
        for (std::size_t i = 0; i < count; ++i) {
            accept(frames_[i]);
        }
        if (count < frames_.size()) break;
    }
    const Time local = core_.crystal.local(now);
    // The SYNC is lost when even that of the last backup would have arrived.
    if (const auto passed = core_.clock.pass(local, core_.table.slot()); passed != 0) {
        core_.counter = (core_.counter + passed) % counter_cycles;
        core_.count.syncs_lost += passed;
        slot_monitor_.close_cycle();
        modes_.switch_over();
        modes_.continue_change();
    }
    core_.count.missed += core_.queue.expire(local);
    update_state(local);
}

void Station::accept(const can::Frame& frame) noexcept {
    if (!frame.is_standard()) return;
    const Crystal& crystal = core_.crystal;
    const auto bits = can::frame_bits(frame).nominal - can::intermission_bits;
    const Time bus_begin = frame.time_ns - (timed_ ? core_.table.bits(bits) : 0);
    const Time begin =
        crystal.stamp(frame.time_ns) - (crystal.local(frame.time_ns) - crystal.local(bus_begin));
    core_.last_begin = std::max(core_.last_begin, begin);
    if (frame.id == sync_id) return accept_sync(frame, begin);
    const SlotTime w = core_.where(begin);
    if (frame.own) return accept_echo(frame, w, bus_begin);
    slot_monitor_.check(frame, w);
    if (std::uint32_t slot = 0; decode_announcement(frame, slot)) {
        return accept_announcement(slot, w);
    }
    if (frame.id >= configuration_ids) {
        accept_configuration(frame);
    }
    ++core_.count.received;
    core_.events.on_frame(frame, bus_begin);
}

void Station::accept_announcement(std::uint32_t slot, const SlotTime& w) noexcept {
    if (!w.known || w.at.slot != slot) return;
    transmitter_.announced(w.at);
    slot_monitor_.announced(w);
    slot_monitor_.monitor_heard();
}

/// Handles a SYNC, of others or the echo of an own one.
void Station::accept_sync(const can::Frame& frame, Time begin) noexcept {
    if (frame.own) {
        if (sync_.sent(begin) == 0) return;
        slot_monitor_.close_cycle();
        modes_.switch_over();
        modes_.continue_change();
        if (core_.counter == 0) {
            sync_.announce_table();
        }
        return;
    }
    Sync s;
    if (!decode(frame, s)) {
        ++core_.count.syncs_ignored;
        return;
    }
    const bool led = core_.leading;
    if (core_.is_sync_node()) {
        sync_.other_sent(s);
    }
    if (core_.leading) return;
    const std::uint64_t before = core_.clock.cycle();
    const bool was_known = core_.clock.known();
    if (!synchronises(begin - core_.table.sync_offset(s.sender), led)) return;
    ++core_.count.syncs;
    sync_.follow(s.sender);
    const auto passed = core_.clock.cycle() - before;
    if (passed > 1 && was_known) {
        core_.count.syncs_lost += passed - 1;
    }
    const auto next = static_cast<std::uint32_t>(core_.counter + passed) % counter_cycles;
    core_.counter = s.numbered ? s.counter : static_cast<std::uint32_t>(next);
    core_.numbered = s.numbered;
    slot_monitor_.close_cycle();
    modes_.confirm(s);
    modes_.switch_over();
    modes_.follow(s);
    modes_.continue_change();
}

/// Uses the stamp of a SYNC; `led`: this node has just sent it itself. Returns true when the SYNC
/// begins a cycle.
bool Station::synchronises(Time stamp, bool led) noexcept {
    switch (core_.clock.accept(stamp)) {
    case CycleClock::Accepted::first: core_.numbered = false; return true;
    case CycleClock::Accepted::good: off_rate_ = 0; return true;
    case CycleClock::Accepted::jumped: core_.raise(Event::sync_jumped); return true;
    case CycleClock::Accepted::off_rate:
        core_.numbered = false;
        if (++off_rate_ >= max_off_rate) {
            core_.raise(Event::sync_off_rate, no_node, 0, std::llround(core_.clock.off_ppm()));
        }
        break;
    case CycleClock::Accepted::rejected:
        core_.raise(Event::sync_late, no_node, 0, std::llround(core_.clock.error()));
        break;
    case CycleClock::Accepted::duplicate:
        if (!led) {
            core_.raise(Event::sync_doubled);
        }
        break;
    }
    ++core_.count.syncs_ignored;
    return false;
}

/// Notes that an own frame was sent.
void Station::accept_echo(const can::Frame& frame, const SlotTime& w, Time bus_begin) noexcept {
    if (frame.id == announce_id) {
        transmitter_.announced(w.at);
        return slot_monitor_.announced(w);
    }
    SendQueue::Entry sent;
    const bool known = core_.queue.confirm(frame, sent);
    slot_monitor_.check_own(frame, w, bus_begin);
    if (known || frame.id < configuration_ids) {
        core_.events.on_sent(frame, bus_begin);
    }
}

void Station::accept_configuration(const can::Frame& frame) noexcept {
    if (Request r; decode(frame, r)) {
        accept_request(r);
    } else if (Answer a; decode(frame, a)) {
        modes_.answered(a);
    }
}

/// Handles a message of the node that sends the SYNC, or of the monitor.
void Station::accept_request(const Request& r) noexcept {
    if (r.what == Request::What::silence || r.what == Request::What::resume) return silence(r);
    if (core_.leading) return;
    compare_tables(r);
    if (r.crc == core_.table.crc && r.what != Request::What::table) {
        modes_.prepare(r);
    }
}

void Station::compare_tables(const Request& r) noexcept {
    const bool agrees = r.crc == core_.table.crc;
    if (agrees != core_.listen_only) return;
    core_.listen_only = !agrees;
    core_.raise(agrees ? Event::table_agrees : Event::other_table, no_node, 0, r.crc);
    // it followed another SYNC node, in another phase
    if (agrees && !core_.is_sync_node()) {
        core_.clock.clear();
        core_.numbered = false;
    }
}

/// Handles the monitor's request to send nothing, or to send again. Nodes of another table have
/// other numbers.
void Station::silence(const Request& r) noexcept {
    if (r.mode != core_.node || r.crc != core_.table.crc) return;
    if (r.sender >= core_.table.nodes.size()) return;
    if (core_.table.nodes[r.sender].role != Role::monitor) return;
    if (r.what == Request::What::resume) return reset();
    if (!core_.silenced) {
        core_.raise(Event::silenced_by_monitor, core_.node);
    }
    core_.silenced = true;
    core_.leading = false;
    modes_.cancel();
}

void Station::transmit(Time now, Time period) noexcept {
    if (core_.link == nullptr || core_.first_seen == INT64_MIN) return;
    core_.now = now;
    const Time local = core_.crystal.local(now);
    const bool may_lead = core_.state != State::down && core_.state != State::silenced;
    if (core_.is_sync_node() && may_lead && sync_.lead(local)) {
        transmitter_.begin_cycles();
        update_state(local);
    }
    if (core_.clock.known()) {
        transmitter_.transmit(local, period);
    }
    core_.link->flush(now);
    transmitter_.called(now);
}

// The state.

void Station::watch_controller() noexcept {
    const can::State controller = core_.link->state();
    const bool down = controller == can::State::bus_off || controller == can::State::down;
    if (down == was_down_) return;
    was_down_ = down;
    core_.raise(down ? Event::bus_off : Event::bus_on);
}

/// Returns true when too many SYNCs were lost, or the clocks may have drifted apart too far.
bool Station::is_silent(Time now) const noexcept {
    const CycleClock& clock = core_.clock;
    const Table& table = core_.table;
    if (!clock.known() || core_.leading) return false;
    const Time age = std::max<Time>(now - clock.start(), 0) + table.cycle * clock.lost();
    return clock.lost() > table.lost || table.required_guard(age) > table.guard + table.bits(1);
}

State Station::next_state(bool silent) const noexcept {
    if (was_down_) return State::down;
    if (core_.silenced) return State::silenced;
    if (core_.listen_only || modes_.unknown()) return State::listen_only;
    if (!core_.clock.known()) return State::listening;
    return silent ? State::silent : State::running;
}

/// Derives the state from what is known by now.
void Station::update_state(Time now) noexcept {
    watch_controller();
    const bool silent = is_silent(now);
    if (silent) {
        core_.clock.accept_any_phase();
    }
    if (silent && !was_silent_) {
        ++core_.count.losses;
        core_.raise(Event::sync_lost, no_node, 0, core_.clock.lost());
    }
    was_silent_ = silent;
    const State before = core_.state;
    core_.state = next_state(silent);
    if (core_.state == State::running && before != State::running) {
        core_.raise(Event::running);
    }
    if (core_.state != State::running) {
        core_.count.dropped += core_.queue.drop_waiting(configuration_ids);
    }
}

}  // namespace hal::scocan
