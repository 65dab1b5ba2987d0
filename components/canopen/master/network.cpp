// SPDX-License-Identifier: MIT
#include "network.hpp"

namespace hal::canopen {

void RemoteNode::guard(Time period, std::uint8_t factor, Time now) noexcept {
    guard_period_ = factor == 0 ? 0 : period;
    guard_factor_ = factor;
    next_guard_ = now;
    answered_ = now;
    toggle_known_ = toggle_stuck_ = false;
}

void RemoteNode::on_error_control(const Frame& f, Time now, DeviceEvents& events) noexcept {
    if (f.remote || f.length < 1) return;
    const auto state = static_cast<NmtState>(f.data[0] & 0x7f);
    const bool boot_up = f.data[0] == 0;
    if (guard_period_ != 0 && !boot_up) {
        const auto toggle = static_cast<std::uint8_t>(f.data[0] & 0x80);
        // Behind a gap an answer got lost, and the toggle bit went on without us.
        const bool wrong =
            toggle_known_ && toggle != toggle_ && now - guard_heard_ < guard_period_ * 3 / 2;
        guard_heard_ = now;
        // from this response on: a toggle bit that never alternates stays wrong
        toggle_ = toggle ^ 0x80;
        toggle_known_ = true;
        if (wrong) {
            // a repeated response, or a node whose toggle bit does not alternate (CiA 301)
            ++wrong_toggles_;
            wrong_at_ = now;
            return;
        }
        answered_ = now;
    }
    if (boot_up) {
        ++boot_ups_;
        toggle_known_ = false;
        answered_ = now;
    }
    const bool first = !heard_ || lost_;
    const bool changed = state != state_;
    heard_ = true;
    lost_ = false;
    state_ = state;
    last_ = now;
    watching_ = !boot_up;  // it may take its time until the first heartbeat
    if (boot_up) {
        events.on_node(id_, NodeEvent::boot_up, state, now);
    } else if (first) {
        events.on_node(id_, NodeEvent::alive, state, now);
    } else if (changed) {
        events.on_node(id_, NodeEvent::changed, state, now);
    }
}

void RemoteNode::on_emergency(const Frame& f, Time now, DeviceEvents& events) noexcept {
    if (f.remote || f.length < 3) return;
    const auto e = EmcyConsumer::read(f, now);
    emergencies_[emergency_count_++ % history] = e;
    error_register_ = e.error_register;
    events.on_emergency(id_, e);
}

void RemoteNode::poll(Time now, DeviceEvents& events) noexcept {
    sdo_.poll(now);
    bool silent =
        heartbeat_limit_ != 0 && guard_period_ == 0 && watching_ && now - last_ >= heartbeat_limit_;
    if (guard_period_ != 0) {
        if (now >= next_guard_) {
            Frame f = make_frame(0x700U + id_, 1);
            f.remote = true;
            if (out_.push(f)) {
                next_guard_ += ((now - next_guard_) / guard_period_ + 1) * guard_period_;
            }
        }
        silent = now - answered_ >= guard_period_ * guard_factor_;
    }
    if (!silent || lost_) return;
    lost_ = true;
    toggle_stuck_ =
        guard_period_ != 0 && wrong_at_ > answered_ && now - wrong_at_ <= 2 * guard_period_;
    events.on_node(id_, NodeEvent::lost, state_, now);
}

RemoteNode& Network::add(std::uint8_t id) {
    auto& node = nodes_.at(id);
    if (!node) {
        node = std::make_unique<RemoteNode>(id, out_, settings_);
    }
    return *node;
}

bool Network::command(NmtCommand command, std::uint8_t id) noexcept {
    Frame f = make_frame(0, 2);
    f.data[0] = static_cast<std::uint8_t>(command);
    f.data[1] = id;
    return out_.push(f);
}

bool Network::handle(const Frame& f, Time now) noexcept {
    if (f.extended || f.error || f.id < 0x81) return false;
    auto* node = nodes_[f.id & 0x7f].get();
    if (node == nullptr) return false;
    switch (f.id >> 7) {
    case 0x081 >> 7: node->on_emergency(f, now, events_); return true;
    case 0x580 >> 7:
        if (!node->sdo_.listens_to(f)) return false;
        node->sdo_.handle(f, now);
        return true;
    case 0x700 >> 7: node->on_error_control(f, now, events_); return true;
    default: return false;
    }
}

void Network::poll(Time now) noexcept {
    for (auto& node : nodes_) {
        if (node) {
            node->poll(now, events_);
        }
    }
}

}  // namespace hal::canopen
