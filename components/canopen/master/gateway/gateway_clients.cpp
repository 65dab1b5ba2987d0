// SPDX-License-Identifier: MIT
// The clients of a gateway: connections, lines in, responses and events out.
#include <algorithm>

#include "gateway.hpp"

namespace hal::canopen::gateway {

int Gateway::connect() {
    const auto free = std::find_if(clients_.begin(), clients_.end(),
                                   [](const Client& c) { return !c.connected; });
    const auto place = free == clients_.end() ? clients_.insert(clients_.end(), Client{}) : free;
    *place = {};
    place->connected = true;
    place->net = nets_.size() == 1 ? 1 : 0;
    return static_cast<int>(place - clients_.begin());
}

void Gateway::disconnect(int client) {
    for (auto p = pending_.begin(); p != pending_.end();) {
        if (p->client != client) {
            ++p;
            continue;
        }
        cancel(*p);
        p = pending_.erase(p);
    }
    clients_[static_cast<std::size_t>(client)] = {};
}

void Gateway::receive(int client, std::string_view bytes, Time now) {
    for (std::size_t n = 0; n < bytes.size();) {
        Client& c = clients_[static_cast<std::size_t>(client)];
        const auto end = bytes.find('\n', n);
        const auto piece = bytes.substr(n, end == bytes.npos ? end : end - n);
        n = end == bytes.npos ? bytes.size() : end + 1;
        if (!c.skips) {
            c.in += piece;
        }
        if (c.in.size() > most_line && !c.skips) {
            c.skips = true;
            c.in.clear();
            reject(client, 0, Error::syntax,
                   "the line is longer than " + std::to_string(most_line) + " bytes");
        }
        if (end == bytes.npos) continue;
        const std::string text = std::move(c.in);
        const bool skips = c.skips;
        c.in.clear();
        c.skips = false;
        if (!skips) {
            line(client, text, now);
        }
    }
}

void Gateway::configure(std::string_view commands, Time now) {
    const int client = connect();
    receive(client, commands, now);
    disconnect(client);
}

void Gateway::answer(int client, std::uint32_t sequence, const std::string& text) {
    output(client) += "[" + std::to_string(sequence) + "] " + text + "\r\n";
}
void Gateway::reject(int client, std::uint32_t sequence, Error error, const std::string& why) {
    answer(client, sequence,
           "ERROR:" + std::to_string(static_cast<unsigned>(error)) + " #" + to_string(error) +
               (why.empty() ? "" : ": " + why));
}
void Gateway::send_event(const std::string& event) {
    for (Client& c : clients_) {
        if (c.connected) {
            c.out += event + "\r\n";
        }
    }
}

}  // namespace hal::canopen::gateway
