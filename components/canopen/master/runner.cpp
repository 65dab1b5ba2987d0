// SPDX-License-Identifier: MIT
#include "runner.hpp"

#include <time.h>

namespace hal::canopen {

namespace {

constexpr std::size_t most_frames = 4096;  // taken in one cycle

std::uint64_t value_of(const Entry& e) noexcept { return Dictionary::value<std::uint64_t>(e); }
void          set_value(Entry& e, std::uint64_t value) noexcept { std::memcpy(e.data, &value, e.size < 8 ? e.size : 8); }

DeviceSettings device_settings(const config::MasterConfig& config) {
    DeviceSettings s;
    s.node_id = config.node_id;
    s.queue = 4096;
    s.obeys_nmt = false;
    s.lss = false;
    return s;
}

}  // namespace

Runner::Runner(const config::MasterConfig& config, RunnerEvents& events)
    : config_(config),
      events_(events),
      own_(own_node(config)),
      device_(own_.description, device_settings(config), *this),
      master_(config.setup(), device_.out(), *this) {
    place_.fill(255);
    for (std::size_t n = 0; n < config.nodes.size(); ++n) {
        const std::uint8_t id = config.nodes[n].setup.id;
        place_[id] = static_cast<std::uint8_t>(n);
        statuses_.push_back(&master_.status(id));
        if (config.at_stop == config::AtStop::nothing) continue;
        can::Frame f(
            0, {static_cast<std::uint8_t>(config.at_stop == config::AtStop::stopped ? NmtCommand::stop : NmtCommand::enter_pre_operational),
                id});
        farewell_.push_back(f);
    }
    for (const Placed& p : own_.placed) {
        Slot s;
        s.entry = device_.dictionary().find(p.index, p.sub);
        s.node = static_cast<std::uint16_t>(p.node), s.to_node = p.to_node, s.object = p.object;
        s.has_safe = p.object->safe.has_value(), s.safe = p.object->safe.value_or(0);
        if (s.to_node && s.has_safe) set_value(*s.entry, s.safe);
        slots_.push_back(s);
    }
    for (const Sent& sent : own_.sent) {
        if (!sent.pdo->synchronous() || sent.pdo->transmission == 0) device_.pdos().send_on_change(sent.number);
        outputs_.push_back({&sent, make_frame(sent.pdo->cob, static_cast<std::uint8_t>(sent.pdo->bytes()))});
    }
    was_operational_.assign(statuses_.size(), 0);
    produces_ = config.sync == config::SyncMode::cycle || config.sync == config::SyncMode::timed;
    sync_frame_ = make_frame(config.sync_cob, config.sync_counter != 0 ? 1 : 0);
}

void Runner::open(can::Link& link) noexcept {
    link_ = &link;
    bus_state_ = can::State::active;
    boots_.store(true);
}

void Runner::boot(Time now) noexcept {
    device_.out().clear();
    device_.start(now);
    device_.command(NmtCommand::start, now);
    master_.start(now);
    sync_begun_ = time_begun_ = false;
}

void Runner::receive(Time now) noexcept {
    if (link_ == nullptr) return;
    now_ = now;
    if (boots_.exchange(false)) boot(now);
    std::array<can::Frame, 32> frames;
    for (std::size_t taken = 0; taken < most_frames;) {
        const std::size_t count = link_->receive(frames, now);
        for (std::size_t i = 0; i < count; ++i) {
            // Another master of this process makes our heartbeat, and its NMT commands are no stranger's.
            if (!leads_ && (frames[i].id == 0x700U + config_.node_id || frames[i].id == 0)) continue;
            device_.handle(frames[i], now);
            master_.handle(frames[i], now);
        }
        taken += count;
        if (count < frames.size()) break;
    }
    statistics_ = link_->statistics();
    if (statistics_.state != bus_state_) {
        const auto out_of_order = [](can::State s) { return s == can::State::bus_off || s == can::State::down; };
        if (out_of_order(statistics_.state) && !out_of_order(bus_state_)) device_.bus_off(now);
        if (!out_of_order(statistics_.state) && out_of_order(bus_state_)) device_.bus_back();
        bus_state_ = statistics_.state;
        events_.on_bus_state(bus_state_);
    }
    master_.poll(now);
    if (config_.sync == config::SyncMode::follow) send(now);  // what a SYNC asked for does not wait for transmit()
}

void Runner::take_wishes() noexcept {
    for (std::size_t n = 0; n < statuses_.size(); ++n) {
        const bool now = statuses_[n]->operational;
        if (now && was_operational_[n] == 0)  // it has not heard what was sent on a change before
            for (const Output& out : outputs_)
                for (const Sent::Part& part : out.sent->parts)
                    if (slots_[part.placed].node == n) device_.pdos().trigger(out.sent->number);
        was_operational_[n] = now ? 1 : 0;
    }
    for (Slot& s : slots_) {
        if (!s.to_node) continue;
        if (statuses_[s.node]->operational) set_value(*s.entry, s.wish);
        else if (s.has_safe) set_value(*s.entry, s.safe);
    }
}

void Runner::transmit(Time now, Time period, bool leads) noexcept {
    if (link_ == nullptr || boots_.load()) return;
    now_ = now;
    take_wishes();
    if (produces_ && leads) produce_sync(now, period);
    if (config_.time_period > 0 && leads) produce_time(now);
    device_.poll(now);
    leads_ = leads;
    send(now);
}

void Runner::produce_sync(Time now, Time period) noexcept {
    if (config_.sync == config::SyncMode::timed) {
        // On a grid of its own, but never more than half a thread period early: the period may be no multiple of it.
        if (!sync_begun_) next_sync_ = now;
        if (now + period / 2 < next_sync_) return;
        const Time behind = now > next_sync_ ? (now - next_sync_ + period / 2) / config_.sync_period : 0;
        next_sync_ += (behind + 1) * config_.sync_period;
    }
    // Nodes that are being configured fill the queue, too.
    const bool behind = sync_begun_ && master_.status().state == NetworkState::operational && statistics_.queued != 0;
    sync_begun_ = true;
    if (behind) {
        ++overruns_;
        events_.on_sync_overrun();
    }
    if (device_.produce_sync(now)) ++syncs_;
}

void Runner::produce_time(Time now) noexcept {
    if (time_begun_ && now < next_time_) return;
    next_time_ = (time_begun_ ? next_time_ : now) + config_.time_period;
    if (next_time_ <= now) next_time_ = now + config_.time_period;
    time_begun_ = true;
    constexpr std::int64_t day_ms = 86'400'000, days_to_1984 = 5113;
    std::int64_t           ms = now / millisecond;  // on a bus in memory every run is the same
    if (!link_->description().simulated) {
        timespec t{};
        clock_gettime(CLOCK_REALTIME, &t);
        ms = t.tv_sec * 1000 + t.tv_nsec / 1'000'000 - days_to_1984 * day_ms;
    }
    device_.time().produce({static_cast<std::uint32_t>(ms % day_ms), static_cast<std::uint16_t>(ms / day_ms)});
}

void Runner::send(Time now) noexcept {
    while (const Frame* f = device_.out().front()) {
        const bool heartbeat = f->id == 0x700U + config_.node_id && !f->extended;
        const can::Sent sent = heartbeat && !leads_ ? can::Sent::queued : link_->send(*f, now);
        if (sent == can::Sent::full) break;  // it stays, and goes first in the next cycle
        device_.out().drop();
    }
    link_->flush(now);
}

void Runner::make_safe() noexcept {
    if (link_ == nullptr || boots_.exchange(true)) return;  // nothing was started
    bool synchronous = false;
    for (Output& out : outputs_) {
        std::uint64_t image = 0;
        for (const Sent::Part& part : out.sent->parts) {
            const Slot&         s = slots_[part.placed];
            const std::uint64_t value = s.has_safe ? s.safe : value_of(*s.entry);
            image |= (part.bits >= 64 ? value : value & ((std::uint64_t{1} << part.bits) - 1)) << part.first;
        }
        store(out.frame.data.data(), image);
        link_->send(out.frame, now_);
        synchronous = synchronous || out.sent->pdo->synchronous();
    }
    if (synchronous && produces_) link_->send(sync_frame_, now_);
    for (const can::Frame& f : farewell_) link_->send(f, now_);
    link_->flush(now_);
}

void Runner::on_step(const NodeStatus& status) noexcept {
    if (place_[status.id & 0x7f] != 255) events_.on_step(place_[status.id & 0x7f], status);
}
void Runner::on_network(const NetworkStatus& status) noexcept { events_.on_network(status); }
void Runner::on_emergency(std::uint8_t node, const Emergency& e) noexcept {
    if (place_[node & 0x7f] != 255) events_.on_emergency(place_[node & 0x7f], e);
}
void Runner::on_rpdo_late(unsigned number, Time) noexcept { events_.on_late(own_.received[number - 1]); }

}  // namespace hal::canopen
