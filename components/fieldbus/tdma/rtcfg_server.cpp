// SPDX-License-Identifier: MIT
#include "rtcfg_server.hpp"

#include <algorithm>

namespace hal::tdma::rtcfg {

Server::Server(Station& station, Logical own, std::vector<ClientSetup> clients, std::uint16_t heartbeat_ms, ServerEvents* events)
    : station_(station), own_(own), heartbeat_ms_(heartbeat_ms), events_(events) {
    for (ClientSetup& c : clients) clients_.emplace_back().setup = std::move(c);
}

void Server::become(Client& c, ClientState state) noexcept {
    if (c.state == state) return;
    c.state = state;
    if (events_ != nullptr) events_->on_client(static_cast<std::size_t>(&c - clients_.data()), state);
}

Server::Client* Server::find(const Message& m) noexcept {
    const auto found = std::find_if(clients_.begin(), clients_.end(), [&](const Client& c) {
        return c.setup.mac == m.from ||
               (c.setup.mac == Address{} && m.id == Id::announce_new && m.client.by_ip && m.client == c.setup.logical);
    });
    return found == clients_.end() ? nullptr : &*found;
}

void Server::arrived(std::span<const std::uint8_t> frame, Time now) noexcept {
    Message m;
    if (!decode(frame, m)) return;
    Client* c = find(m);
    if (c == nullptr) return;
    switch (m.id) {
    case Id::announce_new:
        c->setup.mac = m.from;
        c->heard = now;
        c->burst = static_cast<std::uint8_t>(std::clamp<unsigned>(m.burst, 1, 4));
        c->acknowledged = c->sent = 0;
        c->began = false;
        become(*c, (m.flags & wants_stage_2) != 0 ? ClientState::configuring : ClientState::ready);
        c->left = 1;  // the stage 2 frame itself
        break;
    case Id::acknowledge:
        if (c->state != ClientState::configuring || m.length > c->setup.stage_2.size()) break;
        c->heard = now;
        c->acknowledged = c->sent = m.length;
        c->left = c->burst;
        break;
    case Id::ready:
        c->heard = now;
        become(*c, ClientState::ready);
        break;
    case Id::heartbeat: c->heard = now; break;
    default: break;
    }
}

bool Server::send(Message& m) noexcept {
    m.from = station_.address();
    const std::size_t length = encode(m, frame_);
    return length != 0 && station_.send(std::span(frame_).first(length), default_slot, last_priority) == ethernet::Sent::queued;
}

/// One frame of what the client does not have yet.
bool Server::send_stage_2(Client& c) noexcept {
    const auto&       all = c.setup.stage_2;
    const std::span   data(reinterpret_cast<const std::uint8_t*>(all.data()), all.size());
    const std::size_t room = station_.room(default_slot);
    Message           m;
    m.to = c.setup.mac;
    if (!c.began) {
        m.id = Id::stage_2, m.flags = is_ready, m.heartbeat_ms = heartbeat_ms_;
        m.active = static_cast<std::uint32_t>(
            1 + std::count_if(clients_.begin(), clients_.end(), [](const Client& o) { return o.state == ClientState::ready; }));
        m.length = static_cast<std::uint32_t>(data.size());
        m.data = data.first(std::min(stage_2_room(room), data.size()));
    } else {
        if (c.sent >= data.size()) return false;
        m.id = Id::stage_2_fragment, m.offset = c.sent;
        m.data = data.subspan(c.sent, std::min(fragment_room(room), data.size() - c.sent));
    }
    if (!send(m)) return false;
    c.began = true;
    c.sent += static_cast<std::uint32_t>(m.data.size());
    --c.left;
    return true;
}

void Server::before_slots(Time now) noexcept {
    const Time silence = 2 * static_cast<Time>(heartbeat_ms_) * 1'000'000;
    for (Client& c : clients_) {
        if (c.state != ClientState::ready || heartbeat_ms_ == 0 || now - c.heard <= silence + 1'000'000) continue;
        Message m;
        m.id = Id::dead_station, m.to = ethernet::broadcast, m.client = c.setup.logical, m.dead = c.setup.mac;
        if (!send(m)) return;
        become(c, ClientState::dead);
    }
    if (clients_.empty() || station_.waiting(default_slot) > 2) return;  // what others send goes first
    for (std::size_t i = 0; i < clients_.size(); ++i) {
        Client& c = clients_[next_++ % clients_.size()];
        if (c.state == ClientState::configuring && c.left != 0 && send_stage_2(c)) return;
        const bool stuck = c.state == ClientState::configuring && now - c.heard > 5 * invitation;
        if (stuck) become(c, ClientState::searching);
        if ((c.state != ClientState::searching && c.state != ClientState::dead) || now - c.invited < invitation) continue;
        c.invited = now;
        Message m;
        m.id = Id::stage_1, m.to = c.setup.mac == Address{} ? ethernet::broadcast : c.setup.mac;
        m.client = c.setup.logical, m.server = own_;
        m.data = std::span(reinterpret_cast<const std::uint8_t*>(c.setup.stage_1.data()), c.setup.stage_1.size());
        send(m);
        return;
    }
}

}  // namespace hal::tdma::rtcfg
