// SPDX-License-Identifier: MIT
// The control socket of an instance: one thread that serves any number of clients,
// docs/protocol.md.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "text/diagnostic.hpp"

namespace hal {

class Shell;

struct ServerOptions {
    /// a client asked the instance to end; called in the server's thread
    std::function<void()> stop;
    /// one sentence when a client is dropped; may be empty
    std::function<void(std::string_view)> log;
    std::size_t max_request = std::size_t{16} << 20; ///< bytes of one request
    /// replies waiting for a client before it is no longer listened to
    std::size_t queue = std::size_t{1} << 20;
    /// a client with a full queue that reads nothing for this time is disconnected
    int stall_ms = 10000;
    /// members of this group may connect, too; empty: only the user of the process, and root
    std::string group;
    std::size_t max_clients = 256;
    /// connections beyond these, for short commands: an operator always gets in
    std::size_t reserved = 8;
    /// after this time without a request, a client on which nothing depends counts as idle
    int idle_ms = 1000;
};

struct ServerCounts {
    std::uint64_t clients = 0;   ///< connected now
    std::uint64_t accepted = 0;
    std::uint64_t dropped = 0;
    std::uint64_t reclaimed = 0;
    std::uint64_t refused = 0;
    std::uint64_t requests = 0;
    std::uint64_t invalid_requests = 0;
};

class Server {
public:
    /// Serves the shell's session; each client gets a shell of its own. The shell must outlive the
    /// server.
    explicit Server(Shell& shell, ServerOptions options = {});
    /// Ends all connections and waits for the thread; removes the socket. Not with the session's
    /// lock: ending a connection takes it.
    ~Server();
    Server(const Server&) = delete;

    /// Leaves the connections open at the end of the server: the kernel closes them when the
    /// process exits, at once. Clients that wake earlier would take CPU time from the end. Not for
    /// a machine whose programs run: they end when their connections are closed. [any]
    void close_at_exit();

    /// Makes the socket (named by the session's instance name) and starts the thread. False:
    /// `diagnostics` has the reason, for instance that an instance of this name runs already. A
    /// socket left over by a dead process is replaced.
    bool start(Diagnostics& diagnostics);
    const std::string& path() const;
    ServerCounts counts() const;  ///< [any]

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace hal
