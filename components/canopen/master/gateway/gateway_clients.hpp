// SPDX-License-Identifier: MIT
// The clients of a gateway: connections, lines in, responses and events out.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "gateway_command.hpp"

namespace hal::canopen::gateway {

/// See the top of this file. A client is a number from connect(). All functions [setup].
class Clients {
public:
    static constexpr std::size_t max_line = 4 << 20;    ///< bytes
    static constexpr std::size_t max_pending = 64;  ///< commands of a client without a response

    /// What a client has set for its commands; 0: nothing.
    struct Defaults {
        unsigned net = 0;
        unsigned node = 0;
    };

    /// Adds a client, or uses the number of one that left.
    int connect(const Defaults&);
    /// Removes a client.
    void disconnect(int client) { of(client) = {}; }
    /// Collects bytes of a client, complete lines or parts, and calls `on_line` for each complete
    /// one. A line that is too long is rejected.
    void receive(int client, std::string_view bytes,
                 const std::function<void(const std::string&)>& on_line);

    Defaults& defaults(int client) { return of(client).defaults; }
    /// Returns the output for a client; the caller removes what it sent.
    std::string& output(int client) { return of(client).out; }
    /// Returns true when the client waits for nothing.
    bool is_served(int client) const {
        const Client& c = clients_[static_cast<std::size_t>(client)];
        return c.pending == 0 && c.out.empty();
    }

    /// Counts a command that waits for its response. Returns false if there are too many.
    bool add_pending(int client);
    void remove_pending(int client);

    /// Sends the response to a command.
    void answer(int client, std::uint32_t sequence, const std::string& text);
    /// Sends an error as the response to a command.
    void reject(int client, std::uint32_t sequence, Error, const std::string& why = "");
    /// Sends an event to all clients.
    void send_event(const std::string& event);

private:
    struct Client {
        bool connected = false;
        bool skips = false;  ///< discards the rest of a line that was too long
        std::string in, out;
        Defaults defaults;
        std::size_t pending = 0;
    };
    Client& of(int client) { return clients_[static_cast<std::size_t>(client)]; }

    std::vector<Client> clients_;
};

}  // namespace hal::canopen::gateway
