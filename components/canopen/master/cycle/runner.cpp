// SPDX-License-Identifier: MIT
#include "runner.hpp"

#include <algorithm>
#include <time.h>
#include <utility>

#include "hal/clock.hpp"

namespace hal::canopen {

namespace {

// All nodes send for the first time, and frames of an instance before this one still come.
constexpr Time start_transient = 100 * millisecond;

void set_value(Entry& e, std::uint64_t value) noexcept {
    std::memcpy(e.data, &value, e.size < 8 ? e.size : 8);
}

std::uint64_t low_bits(std::uint64_t value, unsigned bits) noexcept {
    return bits >= 64 ? value : value & ((std::uint64_t{1} << bits) - 1);
}

DeviceSettings device_settings(const config::MasterConfig& config) {
    DeviceSettings s;
    s.node_id = config.node_id;
    s.queue = 4096;
    s.nmt_slave = false;
    s.lss = false;
    return s;
}

}  // namespace

Runner::Runner(const config::MasterConfig& config, Events& events)
    : config_(config),
      events_(events),
      own_(own_node(config)),
      device_(own_.description, device_settings(config), *this),
      master_(config.setup(), device_.out(), *this),
      master_objects_(device_.dictionary(), master_),
      flying_(config.flying, device_.out()) {
    add_nodes();
    add_slots();
    add_outputs();
    for (const Received& r : own_.received) {
        if (r.pdo->request != 0) {
            asked_.push_back({r.number, r.node, r.pdo->request});
        }
    }
    device_.srdos().listen(*this);
    for (const OwnSrdo& s : own_.srdos) {
        if (s.pdo->to_node) {
            device_.srdos().derive_inverted(s.number);
        }
    }
    for (const Received& r : own_.received) {
        watches_.emplace_back(*r.pdo);
    }
    late_pdos_.assign(statuses_.size(), 0);
    open_.assign(statuses_.size(), 0);
    was_operational_.assign(statuses_.size(), 0);
    was_started_.assign(statuses_.size(), 0);
    ever_operational_.assign(statuses_.size(), 0);
    produces_ = config.sync == config::SyncMode::cycle || config.sync == config::SyncMode::timed;
    sync_frame_ = make_frame(config.sync_cob, config.sync_counter != 0 ? 1 : 0);
    add_own_identifiers();
}

void Runner::add_nodes() {
    position_.fill(255);
    const bool stops = config_.at_stop == config::AtStop::stopped;
    const NmtCommand command = stops ? NmtCommand::stop : NmtCommand::enter_pre_operational;
    for (std::size_t n = 0; n < config_.nodes.size(); ++n) {
        const std::uint8_t id = config_.nodes[n].setup.id;
        position_[id] = static_cast<std::uint8_t>(n);
        statuses_.push_back(&master_.status(id));
        if (config_.at_stop != config::AtStop::nothing) {
            stop_commands_.emplace_back(
                0U, std::initializer_list<std::uint8_t>{static_cast<std::uint8_t>(command), id});
        }
    }
}

void Runner::add_slots() {
    for (const Placed& p : own_.placed) {
        Slot s;
        s.entry = device_.dictionary().find(p.index, p.sub);
        s.node = static_cast<std::uint16_t>(p.node);
        s.to_node = p.to_node;
        s.object = p.object;
        s.has_safe = p.object->safe.has_value();
        s.safe = p.object->safe.value_or(0);
        if (s.to_node && s.has_safe) {
            set_value(*s.entry, s.safe);
        }
        slots_.push_back(s);
    }
}

void Runner::add_outputs() {
    for (const Sent& sent : own_.sent) {
        if (!sent.pdo->synchronous() || sent.pdo->transmission == 0) {
            device_.pdos().send_on_change(sent.number);
        }
        outputs_.push_back(
            {&sent, make_frame(sent.pdo->cob, static_cast<std::uint8_t>(sent.pdo->bytes()))});
        if (!sent.pdo->multiplexed()) continue;
        for (const Sent::Part& part : sent.parts) {
            multiplexed_.push_back(
                {sent.number, part.placed, sent.pdo->inhibit_100us * 100 * microsecond});
        }
    }
}

/// The identifiers that only this master may send.
void Runner::add_own_identifiers() {
    if (produces_) {
        foreign_.add_sync(sync_frame_.id);
    }
    if (config_.time_period > 0) {
        foreign_.add(0x100);
    }
    if (!config_.flying.enabled) {
        foreign_.add(0);
    }
    foreign_.add(0x80U + config_.node_id);
    for (const config::Node& n : config_.nodes) {
        foreign_.add(0x600U + n.setup.id);
    }
    for (const Output& out : outputs_) {
        if (!out.frame.extended) {
            foreign_.add_rpdo(out.frame.id);
        }
    }
}

void Runner::attach(can::Link& link) noexcept {
    link_ = &link;
    bus_state_ = can::State::active;
    had_bus_ = false;
    begun_ = false;
    safe_.store(true);
    boots_.store(true);
}

/// From nothing: a flying master finds out first whether it is the one.
void Runner::begin(Time now) noexcept {
    was_active_ = false;
    safe_.store(false);
    if (std::exchange(begun_, true)) {
        drop_backlog(now);
    }
    foreign_.begin(now + start_transient);
    if (!config_.flying.enabled) return boot(now);
    device_.out().clear();
    device_.start(now);
    master_.stand_by(now);
    flying_.start(now);
}

void Runner::boot(Time now) noexcept {
    if (!config_.flying.enabled) {
        device_.out().clear();
        device_.start(now);
    }
    device_.command(NmtCommand::start, now);
    master_.start(now);
    std::fill(ever_operational_.begin(), ever_operational_.end(), std::uint8_t{0});
    sync_begun_ = time_begun_ = false;
    // A node that is kept alive needs the SYNC while it is found out that it is.
    sync_open_ =
        config_.sync_at_boot || std::any_of(config_.nodes.begin(), config_.nodes.end(),
                                            [](const auto& n) { return n.setup.keep_alive; });
    steps_changed_ = true;
    unanswered_waits_ = 0;
}

/// The network goes over to this master or to another one.
void Runner::fly(Time now) noexcept {
    flying_.poll(now);
    if (flying_.state() != flying_state_) {
        flying_state_ = flying_.state();
        events_.on_flying();
    }
    if (flying_.active() == was_active_) return;
    was_active_ = flying_.active();
    if (was_active_) return boot(now);
    master_.stand_by(now);  // the other master controls the nodes
    device_.command(NmtCommand::enter_pre_operational, now);
}

void Runner::note_sync(const can::Frame& f, Time now) noexcept {
    if (f.id != config_.sync_cob || f.extended || f.remote ||
        config_.sync != config::SyncMode::follow) {
        return;
    }
    ++syncs_heard_;
    sync_came_ = f.time_ns != 0 ? f.time_ns : now;
    sync_ours_ = f.own;
}

void Runner::note_bus_state(Time now) noexcept {
    const auto out_of_order = [](can::State s) {
        return s == can::State::bus_off || s == can::State::down;
    };
    had_bus_ = had_bus_ || !out_of_order(statistics_.state);
    if (statistics_.state == bus_state_) return;
    if (out_of_order(statistics_.state) && !out_of_order(bus_state_)) {
        device_.bus_off(now);
    }
    if (!out_of_order(statistics_.state) && out_of_order(bus_state_)) {
        device_.bus_recovered();
    }
    bus_state_ = statistics_.state;
    events_.on_bus_state(bus_state_);
}

void Runner::receive(Time now) noexcept {
    if (link_ == nullptr) return;
    now_ = now;
    if (boots_.exchange(false)) {
        begin(now);
    }
    receive_frames(now);
    statistics_ = link_->statistics();
    for (can::Rejected what; link_->rejected(what);) {
        events_.on_rejected(what);
    }
    note_bus_state(now);
    if (config_.flying.enabled) {
        fly(now);
    }
    if (active()) {
        master_.poll(now);
    }
    open_and_close();
    watch_pdos(now);
    watch_srdos(now);
    // what a SYNC asked for does not wait for transmit()
    if (config_.sync == config::SyncMode::follow) {
        send(now);
    }
    // Another thread made the network safe meanwhile, but this cycle went on sending: it is done
    // once more.
    if (boots_.load()) {
        safe_.store(false);
    }
}

std::size_t Runner::receive_frames(Time now) noexcept {
    constexpr std::size_t max = 4096;
    std::array<can::Frame, 32> frames;
    std::size_t taken = 0;
    while (taken < max) {
        const std::size_t count = link_->receive(frames, now);
        for (std::size_t i = 0; i < count; ++i) {
            take(frames[i], now);
        }
        taken += count;
        if (count < frames.size()) break;
    }
    return taken;
}

void Runner::take(const can::Frame& f, Time now) noexcept {
    // Another master of this process may send the heartbeat, and its NMT commands are not foreign.
    const bool own_beat = f.id == 0x700U + config_.node_id && !f.extended;
    if ((own_beat && (f.own || !leads_)) || (f.id == 0 && !leads_)) return;
    note_sync(f, now);
    if (config_.flying.enabled && flying_.handle(f, now)) return;
    if (!f.own && active()) {
        if (const auto report = foreign_.count(f, now)) {
            events_.on_foreign(*report);
        }
    }
    device_.handle(f, now);
    if (!active()) return;
    if (f.id >> 7 == 0x580 >> 7) {
        unanswered_waits_ = 0;
    }
    master_.handle(f, now);
    open_and_close();  // what follows in this cycle may be the node's first PDO
}

// Process data.

/// CiA 302-2: no process data is sent to a node before it is configured, and its own PDOs have an
/// unknown mapping until then. After a loss its outputs get their safe values until it is reset.
void Runner::open_and_close() noexcept {
    if (!std::exchange(steps_changed_, false)) return;
    for (std::size_t n = 0; n < statuses_.size(); ++n) {
        const NodeStatus& s = *statuses_[n];
        if (s.step >= Step::watching && s.step <= Step::running) {
            open_[n] = 1;
        } else if (s.step < Step::watching || s.cause == Cause::boot_up) {
            open_[n] = 0;
        }
        // One that is kept alive may be operational before we know.
        const bool asked =
            s.step == Step::queued || s.step == Step::identifying || s.step == Step::checking_state;
        if (config_.nodes[n].setup.keep_alive && ever_operational_[n] == 0 && asked) {
            open_[n] = 1;
        }
    }
    for (Output& out : outputs_) {
        out.open = std::any_of(
            out.sent->parts.begin(), out.sent->parts.end(),
            [&](const Sent::Part& part) { return open_[slots_[part.placed].node] != 0; });
        device_.pdos().hold_tpdo(out.sent->number, !out.open);
    }
    for (const Received& r : own_.received) {
        device_.pdos().hold_rpdo(r.number, open_[r.node] == 0);
    }
}

bool Runner::mandatory_are_configured() const noexcept {
    for (std::size_t n = 0; n < statuses_.size(); ++n) {
        if (const Step step = statuses_[n]->step; statuses_[n]->mandatory && step != Step::off &&
                                                  (step < Step::ready || step > Step::running)) {
            return false;
        }
    }
    return true;
}

/// A node that has become operational has not heard what was sent on a change before.
void Runner::send_all_to(std::size_t node) noexcept {
    for (const Output& out : outputs_) {
        const auto& parts = out.sent->parts;
        const bool carries = std::any_of(parts.begin(), parts.end(), [&](const Sent::Part& part) {
            return slots_[part.placed].node == node;
        });
        if (carries) {
            device_.pdos().trigger(out.sent->number);
        }
    }
    for (Multiplexed& a : multiplexed_) {
        if (slots_[a.slot].node == node) {
            a.sent = false;
        }
    }
}

/// What a lost node sent does not describe the node that returns: until its first TPDO the inputs
/// have their safe values.
void Runner::forget_inputs_of(std::size_t node) noexcept {
    for (const Slot& s : slots_) {
        if (s.node == node && !s.to_node && s.has_safe) {
            set_value(*s.entry, s.safe);
        }
    }
}

void Runner::accept_outputs() noexcept {
    for (std::size_t n = 0; n < statuses_.size(); ++n) {
        const bool exchanges = operational(n);
        if (exchanges && was_operational_[n] == 0) {
            send_all_to(n);
        }
        was_operational_[n] = exchanges ? 1 : 0;
        if (exchanges) {
            ever_operational_[n] = 1;
        }
        const std::uint8_t started = statuses_[n]->operational ? 1 : 0;
        if (std::exchange(was_started_[n], started) > started) {
            forget_inputs_of(n);
        }
    }
    for (Slot& s : slots_) {
        if (!s.to_node) continue;
        // One that is kept alive may be operational before we know: it gets what it is to have, not
        // what we would have it held at.
        const bool kept = config_.nodes[s.node].setup.keep_alive && ever_operational_[s.node] == 0;
        if (operational(s.node) || kept) {
            set_value(*s.entry, s.output);
        } else if (s.has_safe) {
            set_value(*s.entry, s.safe);
        }
    }
}

/// Round robin, so that an object that changes in every cycle does not block the others.
void Runner::send_multiplexed(Time now) noexcept {
    for (std::size_t n = multiplexed_.size(); n > 0;
         --n, next_multiplexed_ = (next_multiplexed_ + 1) % multiplexed_.size()) {
        Multiplexed& a = multiplexed_[next_multiplexed_ % multiplexed_.size()];
        const Slot& s = slots_[a.slot];
        const auto value = static_cast<std::uint32_t>(number_in(*s.entry) &
                                                      (~std::uint64_t{0} >> (64 - s.object->bits)));
        if (!statuses_[s.node]->operational || (a.sent && value == a.announced)) continue;
        const auto sent = device_.pdos().tpdo(a.number);
        if (a.inhibit != 0 && sent.count != 0 && now - sent.last < a.inhibit) continue;
        if (!device_.pdos().send_dam(a.number, statuses_[s.node]->id, s.object->index,
                                     s.object->sub, value)) {
            return;
        }
        a.announced = value;
        a.sent = true;
    }
}

/// Requests the PDOs that nodes send on request.
void Runner::ask(Time now) noexcept {
    for (Asked& a : asked_) {
        if (!statuses_[a.node]->operational || now < a.next || !device_.pdos().request(a.number)) {
            continue;
        }
        a.next = std::max(a.next + a.every, now + a.every / 2);
    }
}

bool Runner::any_late() const noexcept {
    for (std::size_t n = 0; n < late_pdos_.size(); ++n) {
        if (late_pdos_[n] != 0 && statuses_[n]->mandatory) return true;
    }
    return false;
}

/// Expects the TPDOs of operational nodes within their timeouts.
void Runner::watch_pdos(Time now) noexcept {
    std::fill(late_pdos_.begin(), late_pdos_.end(), std::uint8_t{0});
    for (std::size_t n = 0; n < watches_.size(); ++n) {
        const Received& r = own_.received[n];
        const bool expired =
            watches_[n].step(statuses_[r.node]->operational, device_.pdos().rpdo(r.number).count,
                             syncs_ + syncs_heard_, now);
        if (expired) {
            events_.on_late(n, watches_[n].silence(now));
        }
        if (watches_[n].late()) {
            late_pdos_[r.node] = 1;
        }
    }
}

/// Expects every SRDO of an operational node; invalid data is replaced by its safe values in the
/// same cycle.
void Runner::watch_srdos(Time now) noexcept {
    if (own_.srdos.empty()) return;
    for (const OwnSrdo& s : own_.srdos) {
        device_.srdos().expect(s.number, statuses_[s.node]->operational, now);
    }
    device_.srdos().poll(now);
    for (const OwnSrdo& s : own_.srdos) {
        if (s.pdo->to_node || device_.srdos().status(s.number).valid) continue;
        for (const std::size_t n : s.placed) {
            if (slots_[n].has_safe) {
                set_value(*slots_[n].entry, slots_[n].safe);
            }
        }
    }
}

void Runner::transmit(Time now, Time period, bool leads) noexcept {
    if (link_ == nullptr || boots_.load()) return;
    now_ = now;
    accept_outputs();
    open_and_close();
    sync_open_ = sync_open_ || mandatory_are_configured();
    if (produces_ && sync_open_ && leads && active()) {
        produce_sync(now, period);
    }
    if (config_.time_period > 0 && leads && active()) {
        produce_time(now);
    }
    if (active()) {
        send_multiplexed(now);
        ask(now);
    }
    device_.poll(now);
    leads_ = leads;
    send(now);
    serve_boot(now, period);
    if (boots_.load()) {
        safe_.store(false);
    }
}

/// A request to a node is followed by the next when it was answered: one in a cycle, when only
/// cycles look for answers. While the network boots and no set-point counts yet, a slow thread
/// looks for them for up to a quarter of its period. Not in time slots: nothing leaves during the
/// wait, and afterwards the slot of this cycle may have passed.
void Runner::serve_boot(Time now, Time period) noexcept {
    constexpr Time slow = 2 * millisecond;
    constexpr Time max_wait = millisecond;
    constexpr unsigned max_unanswered_waits = 5;
    const NetworkStatus& network = master_.status();
    if (period < slow || !active() || network.state != NetworkState::booting ||
        network.booting == 0 || unanswered_waits_ >= max_unanswered_waits ||
        link_->description().simulated || link_->description().in_slots) {
        return;
    }
    const Time begun = monotonic_ns();
    bool any = false;
    for (Time at = begun, heard = begun; at - begun < period / 4 && at - heard < max_wait;
         at = monotonic_ns()) {
        const Time then = now + (at - begun);
        if (receive_frames(then) == 0) continue;
        any = true;
        heard = at;
        master_.poll(then);
        open_and_close();
        send(then);
    }
    unanswered_waits_ = any ? 0 : unanswered_waits_ + 1;
}

void Runner::produce_sync(Time now, Time period) noexcept {
    if (config_.sync == config::SyncMode::timed) {
        // The phase is kept, but a SYNC is never more than half a thread period early: its period
        // need not be a multiple of that of the thread.
        if (!sync_begun_) {
            next_sync_ = now;
        }
        if (now + period / 2 < next_sync_) return;
        const Time behind =
            now > next_sync_ ? (now - next_sync_ + period / 2) / config_.sync_period : 0;
        next_sync_ += (behind + 1) * config_.sync_period;
    }
    // Nodes that are being configured fill the queue, too.
    const NetworkStatus& network = master_.status();
    const bool settled = network.state == NetworkState::operational &&
                         now - network.operational_since >= start_transient;
    const bool behind = sync_begun_ && settled && statistics_.queued != 0;
    sync_begun_ = true;
    if (behind) {
        ++overruns_;
        events_.on_sync_overrun();
    }
    if (device_.produce_sync(now)) {
        ++syncs_;
    }
}

void Runner::produce_time(Time now) noexcept {
    if (time_begun_ && now < next_time_) return;
    next_time_ = (time_begun_ ? next_time_ : now) + config_.time_period;
    if (next_time_ <= now) {
        next_time_ = now + config_.time_period;
    }
    time_begun_ = true;
    constexpr std::int64_t day_ms = 86'400'000;
    constexpr std::int64_t days_to_1984 = 5113;
    std::int64_t ms = now / millisecond;  // on a bus in memory every run is the same
    if (!link_->description().simulated) {
        timespec t{};
        clock_gettime(CLOCK_REALTIME, &t);
        ms = t.tv_sec * 1000 + t.tv_nsec / 1'000'000 - days_to_1984 * day_ms;
    }
    device_.time().produce(
        {static_cast<std::uint32_t>(ms % day_ms), static_cast<std::uint16_t>(ms / day_ms)});
}

void Runner::send(Time now) noexcept {
    const bool stuck = is_stuck(now);
    if (!stuck && std::exchange(holds_frames_, false)) {
        send_held_values();
    }
    while (const Frame* f = device_.out().front()) {
        const bool heartbeat = f->id == 0x700U + config_.node_id && !f->extended;
        if (stuck && is_process_data(*f)) {
            ++withheld_;
            holds_frames_ = true;
            device_.out().drop();
            continue;
        }
        const can::Sent sent = heartbeat && !leads_ ? can::Sent::queued : link_->send(*f, now);
        if (sent == can::Sent::full) {
            break;  // it stays, and goes first in the next cycle
        }
        device_.out().drop();
    }
    link_->flush(now);
}

/// What is sent on a change only was lost with what was kept back.
void Runner::send_held_values() noexcept {
    for (const Output& out : outputs_) {
        device_.pdos().trigger(out.sent->number);
    }
    for (Multiplexed& a : multiplexed_) {
        a.sent = false;
    }
}

/// The bus takes nothing: nobody acknowledges, or others keep it. Set-points of these cycles would
/// wait in the queue, and move the machine by what was wanted long ago when the cable is back.
bool Runner::is_stuck(Time now) noexcept {
    constexpr Time max_wait = 20 * millisecond;
    constexpr Time max_frame_bits = 160;  // 29-bit identifier, eight bytes, all stuff bits
    const can::Statistics s = link_->statistics();
    if (moved_ == 0 || s.queued == 0 || s.sent != sent_before_) {
        moved_ = now;
    }
    sent_before_ = s.sent;
    return now - moved_ >
           std::max(max_wait, 100 * max_frame_bits * second / std::max<Time>(config_.bit_rate, 1));
}

bool Runner::is_process_data(const can::Frame& f) const noexcept {
    const auto same = [&](const can::Frame& other) {
        return f.id == other.id && f.extended == other.extended;
    };
    const bool asks = f.remote && (f.extended || f.id < 0x700);  // not the guarding of a node
    return asks || same(sync_frame_) ||
           std::any_of(outputs_.begin(), outputs_.end(),
                       [&](const Output& o) { return same(o.frame); });
}

// A thread that stops, and what arrived until it runs again.

void Runner::make_safe() noexcept {
    if (link_ == nullptr) return;
    boots_.store(true);
    if (safe_.exchange(true)) {
        return;  // nothing was started, or the safe values were sent
    }
    if (!active()) {
        return;  // the network is another one's
    }
    if (!send_safe_values()) {
        safe_.store(false);
    }
}

/// Returns the safe value of an object; one without has its last value.
std::uint64_t Runner::safe_value(const Slot& s) noexcept {
    return s.has_safe ? s.safe : number_in(*s.entry);
}

/// Returns the safe values of a PDO to a node.
std::uint64_t Runner::safe_image(const Sent& sent) const noexcept {
    std::uint64_t image = 0;
    for (const Sent::Part& part : sent.parts) {
        image |= low_bits(safe_value(slots_[part.placed]), part.bits) << part.first;
    }
    return image;
}

/// Returns the safe values of an SRDO to a node.
std::uint64_t Runner::safe_image(const OwnSrdo& srdo) const noexcept {
    std::uint64_t image = 0;
    unsigned bit = 0;
    for (const std::size_t n : srdo.placed) {
        const unsigned bits = slots_[n].object->bits;
        image |= low_bits(safe_value(slots_[n]), bits) << bit;
        bit += bits;
    }
    return image;
}

/// Returns whether the link took all of them.
bool Runner::send_safe_values() noexcept {
    bool all = true;
    bool synchronous = false;
    const auto send = [&](const can::Frame& f) {
        if (link_->send(f, now_) != can::Sent::queued) {
            all = false;
        }
    };
    for (const Output& out : outputs_) {
        if (!out.open) continue;
        if (out.sent->pdo->multiplexed()) {
            all = make_multiplexed_safe(out) && all;
            continue;
        }
        can::Frame f = out.frame;
        store(f.data.data(), safe_image(*out.sent));
        send(f);
        synchronous = synchronous || out.sent->pdo->synchronous();
    }
    if (synchronous && produces_) {
        send(sync_frame_);
    }
    for (const OwnSrdo& srdo : own_.srdos) {  // silence alone would take the node its SCT
        if (!srdo.pdo->to_node) continue;
        const std::uint64_t image = safe_image(srdo);
        can::Frame f = make_frame(srdo.pdo->cob, static_cast<std::uint8_t>(srdo.pdo->bytes()));
        store(f.data.data(), image);
        send(f);
        f.id = srdo.pdo->cob + 1;
        store(f.data.data(), ~image);
        send(f);
    }
    for (const can::Frame& f : stop_commands_) {
        send(f);
    }
    link_->flush(now_);
    return all;
}

/// Returns whether the link took all of them.
bool Runner::make_multiplexed_safe(const Output& out) noexcept {
    bool all = true;
    for (const Sent::Part& part : out.sent->parts) {
        const Slot& s = slots_[part.placed];
        can::Frame f = out.frame;
        f.data[0] = static_cast<std::uint8_t>(0x80 | statuses_[s.node]->id);
        store(f.data.data() + 1, s.object->index);
        f.data[3] = s.object->sub;
        store(f.data.data() + 4, static_cast<std::uint32_t>(safe_value(s)));
        if (link_->send(f, now_) != can::Sent::queued) {
            all = false;
        }
    }
    return all;
}

/// Drops the frames that arrived while no cycles ran: their values and answers are old. Emergencies
/// are still reported.
void Runner::drop_backlog(Time now) noexcept {
    constexpr std::size_t max_frames = 8192;
    std::array<can::Frame, 32> frames;
    for (std::size_t dropped = 0; dropped < max_frames; dropped += frames.size()) {
        const std::size_t count = link_->receive(frames, now);
        for (std::size_t i = 0; i < count; ++i) {
            const can::Frame& f = frames[i];
            const bool is_data = !f.extended && !f.remote && !f.error;
            const bool is_emergency = is_data && f.id > 0x80 && f.id < 0x100;
            if (is_emergency && active()) {
                master_.handle(f, now);
            }
        }
        if (count < frames.size()) return;
    }
}

// Events of the master.

void Runner::on_step(const NodeStatus& status) noexcept {
    steps_changed_ = true;
    if (position_[status.id & 0x7f] != 255) {
        events_.on_step(position_[status.id & 0x7f], status);
    }
}
void Runner::on_network(const NetworkStatus& status) noexcept { events_.on_network(status); }
void Runner::on_emergency(std::uint8_t node, const Emergency& e) noexcept {
    if (position_[node & 0x7f] != 255) {
        events_.on_emergency(position_[node & 0x7f], e);
    }
}

}  // namespace hal::canopen
