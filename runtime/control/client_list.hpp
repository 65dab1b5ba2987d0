// SPDX-License-Identifier: MIT
// The connected clients, and the ways in which a connection ends. Internal to the server.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "control/served_client.hpp"
#include "control/server.hpp"

namespace hal {

/// Used by the server's thread only, except for `dropped`. A client that is gone stays in the list
/// until remove_gone().
class ClientList {
public:
    using Clients = std::vector<std::unique_ptr<ServedClient>>;

    explicit ClientList(const ServerOptions& options) : options_(options) {}

    Clients& all() { return clients_; }
    const Clients& all() const { return clients_; }
    /// Returns the number of clients with or without a place.
    std::size_t count(bool placed) const;
    /// Returns true when requests of this client are read: it has few replies pending, and space
    /// for another request.
    bool listens_to(const ServedClient& client) const;

    /// Sends what the client reads at once. Disconnects a client that reads nothing for too long.
    void send_out(ServedClient& client);
    /// Ends a connection: what the client sent last is not executed, what its command waits for is
    /// not waited for.
    void leave(ServedClient& client);
    /// Sends the client the reason, then ends its connection.
    void close(ServedClient& client, const std::string& reason);
    void log(const std::string& sentence) const;

    std::atomic<std::uint64_t> dropped{0};  ///< clients that read nothing [any]

private:
    const ServerOptions& options_;
    Clients clients_;
};

}  // namespace hal
