// SPDX-License-Identifier: MIT
#include "error_control.hpp"

namespace hal::canopen {

ErrorControl::ErrorControl(Dictionary& dictionary, FrameQueue& out)
    : dictionary_(dictionary), out_(out) {
    for (const int index : {0x100c, 0x100d, 0x1016, 0x1017}) {
        dictionary.handle(static_cast<std::uint16_t>(index), *this);
    }
}

void ErrorControl::reset(std::uint8_t node_id) noexcept {
    node_id_ = node_id;
    state_ = NmtState::initialising;
    booted_ = boot_pending_ = guarding_ = life_lost_ = collided_ = false;
    toggle_ = 0;
    lost_ = 0;
    highest_ = 0;
    consumers_.fill({});
    for (const auto& e : dictionary_.object(0x1016)) {
        read_consumer(e);
    }
    read_producer();
}

void ErrorControl::read_consumer(const Entry& e) noexcept {
    if (e.sub == 0 || e.sub > 127) return;
    auto& c = consumers_[e.sub];
    if (c.lost) {
        --lost_;
    }
    const auto value = load<std::uint32_t>(e.data);
    c = {};
    c.node = static_cast<std::uint8_t>(value >> 16);
    c.limit = static_cast<Time>(value & 0xffff) * millisecond;
    if (c.node < 1 || c.node > 127) {
        c.limit = 0;
    }
    if (c.limit != 0 && e.sub > highest_) {
        highest_ = e.sub;
    }
}

void ErrorControl::read_producer() noexcept {
    period_ = dictionary_.get<std::uint16_t>(0x1017, 0) * millisecond;
    due_now_ = true;
    life_time_ = static_cast<Time>(dictionary_.get<std::uint16_t>(0x100c, 0)) *
                 dictionary_.get<std::uint8_t>(0x100d, 0) * millisecond;
    if (life_time_ == 0 || period_ != 0) {
        guarding_ = life_lost_ = false;
    }
}

void ErrorControl::boot(Time now) noexcept {
    booted_ = true;
    boot_pending_ = true;
    next_ = now + period_;
    due_now_ = false;
    send_boot_up();
}

void ErrorControl::send_boot_up() noexcept {
    boot_pending_ = !out_.push(make_frame(0x700U + node_id_, 1));
}

bool ErrorControl::handle(const Frame& f, Time now, DeviceEvents& events) noexcept {
    if (f.extended || f.id <= 0x700 || f.id >= 0x780) return false;
    const auto node = static_cast<std::uint8_t>(f.id - 0x700);
    if (f.remote) {
        // The heartbeat excludes guarding (CiA 301), and nothing is sent before the boot-up
        // message.
        const bool answers = node == node_id_ && booted_ && !boot_pending_ && period_ == 0;
        if (answers) {
            answer_guarding(now, events);
        }
        return true;
    }
    if (f.length < 1) return true;
    if (node != node_id_) {
        on_heartbeat(node, static_cast<NmtState>(f.data[0] & 0x7f), now, events);
        return true;
    }
    if (!collided_) {
        events.on_id_collision(now);
    }
    collided_ = true;
    return true;
}

void ErrorControl::answer_guarding(Time now, DeviceEvents& events) noexcept {
    Frame answer = make_frame(0x700U + node_id_, 1);
    answer.data[0] = static_cast<std::uint8_t>(static_cast<std::uint8_t>(state_) | toggle_);
    if (out_.push(answer)) {
        toggle_ ^= 0x80;
    }
    if (life_time_ != 0) {
        guarding_ = true;
        guarded_ = now;
    }
    if (life_lost_) {
        life_lost_ = false;
        events.on_life_guarding(false, now);
    }
}

void ErrorControl::on_heartbeat(std::uint8_t node, NmtState state, Time now,
                                DeviceEvents& events) noexcept {
    for (std::size_t n = 1; n <= highest_; ++n) {
        auto& c = consumers_[n];
        if (c.node != node || c.limit == 0) continue;
        const bool first = !c.watching || c.lost;
        const bool changed = state != c.state;
        if (c.lost) {
            --lost_;
        }
        c.watching = state != NmtState::initialising;
        c.lost = false;
        c.heard = now;
        c.state = state;
        // After a boot-up the timeout starts with the first heartbeat.
        if (state == NmtState::initialising) {
            events.on_node(node, NodeEvent::boot_up, state, now);
        } else if (first) {
            events.on_node(node, NodeEvent::alive, state, now);
        } else if (changed) {
            events.on_node(node, NodeEvent::changed, state, now);
        }
        return;
    }
}

ErrorControl::Change ErrorControl::poll(Time now, DeviceEvents& events) noexcept {
    Change change;
    if (!booted_) return change;
    if (boot_pending_) {
        send_boot_up();
    }
    if (period_ != 0 && !boot_pending_) {
        if (due_now_) {
            next_ = now;
            due_now_ = false;
        }
        if (now >= next_) {
            Frame beat = make_frame(0x700U + node_id_, 1);
            beat.data[0] = static_cast<std::uint8_t>(state_);
            if (out_.push(beat)) {
                next_ += ((now - next_) / period_ + 1) * period_;
            }
        }
    }
    if (guarding_ && !life_lost_ && now - guarded_ >= life_time_) {
        life_lost_ = true;
        events.on_life_guarding(true, now);
        change.lost = true;
    }
    for (std::size_t n = 1; n <= highest_; ++n) {
        auto& c = consumers_[n];
        if (!c.watching || c.lost || now - c.heard < c.limit) continue;
        c.lost = true;
        ++lost_;
        events.on_node(c.node, NodeEvent::lost, c.state, now);
        change.lost = true;
        change.node = c.node;
    }
    change.recovered = all_alive();
    return change;
}

Abort ErrorControl::writing(Entry& e, std::span<const std::uint8_t> value) noexcept {
    if (e.index != 0x1016) return Abort::none;
    const auto wanted = load<std::uint32_t>(value.data());
    const auto node = wanted >> 16 & 0xff;
    if (node == 0 || (wanted & 0xffff) == 0) return Abort::none;
    if (node > 127) return Abort::incompatible;
    for (std::size_t n = 1; n <= highest_; ++n) {
        if (n != e.sub && consumers_[n].limit != 0 && consumers_[n].node == node) {
            return Abort::incompatible;
        }
    }
    return Abort::none;
}

void ErrorControl::written(Entry& e) noexcept {
    if (e.index == 0x1016) return read_consumer(e);
    read_producer();
}

}  // namespace hal::canopen
