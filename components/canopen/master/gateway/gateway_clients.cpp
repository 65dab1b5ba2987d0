// SPDX-License-Identifier: MIT
#include "gateway_clients.hpp"

#include <algorithm>

namespace hal::canopen::gateway {

int Clients::connect(const Defaults& defaults) {
    const auto free = std::find_if(clients_.begin(), clients_.end(),
                                   [](const Client& c) { return !c.connected; });
    const auto client = free == clients_.end() ? clients_.insert(clients_.end(), Client{}) : free;
    *client = {};
    client->connected = true;
    client->defaults = defaults;
    return static_cast<int>(client - clients_.begin());
}

void Clients::receive(int client, std::string_view bytes,
                      const std::function<void(const std::string&)>& on_line) {
    while (!bytes.empty()) {
        Client& c = of(client);
        const auto end = bytes.find('\n');
        const bool is_complete = end != bytes.npos;
        const auto piece = bytes.substr(0, end);
        bytes.remove_prefix(is_complete ? end + 1 : bytes.size());
        if (!c.skips) {
            c.in += piece;
        }
        if (c.in.size() > max_line) {
            c.skips = true;
            c.in.clear();
            reject(client, 0, Error::syntax,
                   "the line is longer than " + std::to_string(max_line) + " bytes");
        }
        if (!is_complete) continue;
        const std::string line = std::move(c.in);
        const bool skips = c.skips;
        c.in.clear();
        c.skips = false;
        if (!skips) {
            on_line(line);
        }
    }
}

bool Clients::add_pending(int client) {
    Client& c = of(client);
    if (c.pending >= max_pending) return false;
    ++c.pending;
    return true;
}

void Clients::remove_pending(int client) {
    Client& c = of(client);
    if (c.pending > 0) {
        --c.pending;
    }
}

void Clients::answer(int client, std::uint32_t sequence, const std::string& text) {
    output(client) += "[" + std::to_string(sequence) + "] " + text + "\r\n";
}

void Clients::reject(int client, std::uint32_t sequence, Error error, const std::string& why) {
    std::string text =
        "ERROR:" + std::to_string(static_cast<unsigned>(error)) + " #" + to_string(error);
    if (!why.empty()) {
        text += ": " + why;
    }
    answer(client, sequence, text);
}

void Clients::send_event(const std::string& event) {
    for (Client& c : clients_) {
        if (c.connected) {
            c.out += event + "\r\n";
        }
    }
}

}  // namespace hal::canopen::gateway
