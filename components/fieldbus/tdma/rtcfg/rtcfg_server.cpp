// SPDX-License-Identifier: MIT
#include "rtcfg_server.hpp"

#include <algorithm>
#include <utility>

namespace hal::tdma::rtcfg {

Server::Server(Station& station, Logical own, std::vector<ClientSetup> clients,
               std::uint16_t heartbeat_ms, ServerEvents* events)
    : station_(station), own_(own), heartbeat_ms_(heartbeat_ms), events_(events) {
    for (ClientSetup& c : clients) {
        clients_.emplace_back().setup = std::move(c);
    }
}

void Server::begin() noexcept {
    for (Client& c : clients_) {
        if (c.learnt) {
            c.setup.mac = {};
        }
        const ClientSetup setup = std::move(c.setup);
        c = {};
        c.setup = setup;
    }
    ready_ = 0;
    foreign_ = 0;
    serves_ = false;
}

void Server::serve(Time now) noexcept {
    serves_ = true;
    began_ = now;
    if (station_.setup().role == Role::master) return;
    const Time known = now + 10 * station_.setup().cycle;  // by then all have heard the master
    for (Client& c : clients_) {
        c.invited = known - invitation;
    }
}

/// Another server is active: forgets the clients.
void Server::rest() noexcept {
    if (!serves_) return;
    serves_ = false;
    for (Client& c : clients_) {
        c.state = ClientState::searching;
        c.restart = c.began = false;
        c.invited = INT64_MIN / 2;
    }
    ready_ = 0;
}

void Server::become(Client& c, ClientState state) noexcept {
    if (c.state == state) return;
    c.state = state;
    ready_ = static_cast<std::uint32_t>(
        std::count_if(clients_.begin(), clients_.end(),
                      [](const Client& o) { return o.state == ClientState::ready; }));
    if (events_ != nullptr) {
        events_->on_client(static_cast<std::size_t>(&c - clients_.data()), state, c.setup.mac);
    }
}

/// Returns the sender; by its IP address only when the MAC address is unknown or that client is
/// lost.
Server::Client* Server::find(const Message& m) noexcept {
    for (Client& c : clients_) {
        if (c.setup.mac == m.from) return &c;
    }
    if (m.id != Id::announce_new || !m.client.by_ip) return nullptr;
    for (Client& c : clients_) {
        const bool open =
            c.setup.mac == Address{} ||
            (c.learnt && (c.state == ClientState::dead || c.state == ClientState::searching));
        if (!open || m.client != c.setup.logical) continue;
        c.learnt = true;
        c.setup.mac = m.from;
        return &c;
    }
    return nullptr;
}

void Server::heard(const Address& from, Time now) noexcept {
    for (Client& c : clients_) {
        if (c.setup.mac == from) {
            c.seen = now;
        }
    }
}

void Server::arrived(std::span<const std::uint8_t> frame, Time now) noexcept {
    if (!serves_) return;
    Message m;
    Client* c = decode(frame, m) ? find(m) : nullptr;
    if (c == nullptr || !take(*c, m, now)) {
        ++foreign_;
    }
}

bool Server::take(Client& c, const Message& m, Time now) noexcept {
    switch (m.id) {
    case Id::announce_new:
        c.heard = now;
        c.burst = static_cast<std::uint8_t>(std::clamp<unsigned>(m.burst, 1, 4));
        c.sent = 0;
        c.began = c.restart = false;
        c.left = 1;  // the stage 2 frame itself
        become(c, (m.flags & wants_stage_2) != 0 ? ClientState::configuring : ClientState::ready);
        return true;
    case Id::acknowledge:
        // a repetition is harmless
        if (c.state != ClientState::configuring || m.length > c.sent) {
            return c.state == ClientState::ready;
        }
        c.heard = now;
        c.sent = m.length;
        c.left = c.burst;
        return true;
    case Id::ready:
    case Id::heartbeat:
        c.heard = now;
        if (c.state == ClientState::searching || c.state == ClientState::dead) {
            c.restart = true;
        } else {
            become(c, ClientState::ready);  // a heartbeat: the ready frame was lost
        }
        return true;
    case Id::announce_reply: return true;
    default: return false;  // from another server
    }
}

bool Server::send(Message& m) noexcept {
    m.from = station_.address();
    const std::size_t length = encode(m, frame_);
    return length != 0 && station_.send(std::span(frame_).first(length), default_slot,
                                        last_priority) == ethernet::Sent::queued;
}

/// Sends the next frame of the file.
bool Server::send_stage_2(Client& c) noexcept {
    const auto& all = c.setup.stage_2;
    const std::span data(reinterpret_cast<const std::uint8_t*>(all.data()), all.size());
    const std::size_t capacity = station_.capacity(default_slot);
    Message m;
    m.to = c.setup.mac;
    if (!c.began) {
        m.id = Id::stage_2;
        m.flags = is_ready;
        m.heartbeat_ms = heartbeat_ms_;
        m.active = static_cast<std::uint32_t>(
            1 + std::count_if(clients_.begin(), clients_.end(),
                              [](const Client& o) { return o.state == ClientState::ready; }));
        m.length = static_cast<std::uint32_t>(data.size());
        m.data = data.first(std::min(stage_2_capacity(capacity), data.size()));
    } else {
        if (c.sent >= data.size()) return false;
        m.id = Id::stage_2_fragment;
        m.offset = c.sent;
        m.data = data.subspan(c.sent, std::min(fragment_capacity(capacity), data.size() - c.sent));
    }
    if (!send(m)) return false;
    c.began = true;
    c.sent += static_cast<std::uint32_t>(m.data.size());
    --c.left;
    return true;
}

/// Returns true when a frame was queued.
bool Server::invite(Client& c, Time now) noexcept {
    if (c.state != ClientState::searching && c.state != ClientState::dead) return false;
    if (now - c.invited < invitation || (now - c.seen < invitation && !c.restart)) return false;
    Message m;
    m.id = Id::stage_1;
    m.to = c.setup.mac == Address{} ? ethernet::broadcast : c.setup.mac;
    m.client = c.setup.logical;
    m.server = own_;
    m.data = std::span(reinterpret_cast<const std::uint8_t*>(c.setup.stage_1.data()),
                       c.setup.stage_1.size());
    if (stage_1_bytes(m) > station_.capacity(default_slot)) {
        if (!c.too_long_reported && now - std::max(c.seen, began_) > long_silence &&
            events_ != nullptr) {
            c.too_long_reported = true;
            events_->on_too_long(static_cast<std::size_t>(&c - clients_.data()));
        }
        return false;
    }
    c.invited = now;
    c.restart = false;
    return send(m);
}

/// Extends all timeouts by a time without cycles, in which the server could not receive heartbeats.
void Server::excuse(Time now) noexcept {
    constexpr Time max_pause = 100'000'000;
    const Time pause = now - std::exchange(last_slots_, now);
    if (pause <= max_pause) return;
    for (Client& c : clients_) {
        c.heard += pause;
    }
}

void Server::before_slots(Time now) noexcept {
    excuse(now);
    if (!station_.status().leading) return rest();
    if (!serves_) {
        serve(now);
    }
    const Time silence = 2 * static_cast<Time>(heartbeat_ms_) * 1'000'000;
    for (Client& c : clients_) {
        if (c.state != ClientState::ready || heartbeat_ms_ == 0 ||
            now - c.heard <= silence + 1'000'000) {
            continue;
        }
        Message m;
        m.id = Id::dead_station;
        m.to = ethernet::broadcast;
        m.client = c.setup.logical;

        m.dead = c.setup.mac;
        if (!send(m)) return;
        become(c, ClientState::dead);
    }
    if (clients_.empty() || station_.waiting(default_slot) > 2) {
        return;  // lowest priority
    }
    for (std::size_t i = 0; i < clients_.size(); ++i) {
        Client& c = clients_[next_++ % clients_.size()];
        if (c.state == ClientState::configuring && c.left != 0 && send_stage_2(c)) return;
        if (c.state == ClientState::configuring && now - c.heard > 5 * invitation) {
            become(c, ClientState::searching);
        }
        if (invite(c, now)) return;
    }
}

}  // namespace hal::tdma::rtcfg
