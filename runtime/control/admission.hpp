// SPDX-License-Identifier: MIT
// Which clients the server accepts, and which it closes for others. Internal to the server.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <utility>

#include "control/client_list.hpp"
#include "control/endpoint.hpp"
#include "control/server.hpp"

namespace hal {

class Shell;

/// Used by the server's thread only, except for the counters.
///
/// A client gets in when all places are taken, and with the descriptor that is kept in reserve when
/// the process has no other: so the next `stop` is seen whatever clients do.
class Admission {
public:
    /// `wake` is called by other threads, to end the poll of the server's thread.
    Admission(Shell& shell, const ServerOptions& options, const Endpoint& endpoint,
              ClientList& clients, std::function<void()> wake)
        : shell_(shell),
          options_(options),
          endpoint_(endpoint),
          clients_(clients),
          wake_(std::move(wake)) {}
    ~Admission();
    Admission(const Admission&) = delete;

    /// Returns false for some milliseconds after accept has failed.
    bool accepts(std::int64_t now_ns) const { return now_ns >= accepts_from_ns_; }
    /// Returns when reclaim(), place_clients() or accept_clients() has to run again, on the steady
    /// clock; INT64_MAX when nothing is pending.
    std::int64_t next_due_ns(std::int64_t now_ns) const;

    void accept_clients();
    /// Gives free places to those who wait for one, in the order in which they came, and closes the
    /// connection of those who have waited too long.
    void place_clients();
    /// While more clients are connected than there are places, closes those that have been idle
    /// longest, and one in a reserved place that keeps it from the next. When the process has no
    /// descriptor left, closes an idle client, too.
    void reclaim();
    /// Opens the descriptor in reserve again, once no client uses it.
    void keep_spare();
    void close_spare();
    /// The process that connected has ended: what it has sent is still read, then follows the end
    /// of the connection, also for a child that holds a copy of the socket.
    void note_process_end(ServedClient& client);

    std::atomic<std::uint64_t> accepted{0};
    std::atomic<std::uint64_t> reclaimed{0};
    std::atomic<std::uint64_t> refused{0};

private:
    int accept_one();
    void add_client(int fd);
    void watch_process(ServedClient& client);
    bool give_up_watch();
    ServedClient* max_idle(std::int64_t idle_ns) const;
    bool close_one_idle(std::int64_t idle_ns);
    bool make_way();
    bool may_reclaim(const ServedClient& client, bool is_full, std::int64_t idle_ns,
                     std::int64_t now_ns) const;
    void close_idle(ServedClient& client);
    std::size_t places() const { return options_.max_clients + options_.reserved; }

    Shell& shell_;
    const ServerOptions& options_;
    const Endpoint& endpoint_;
    ClientList& clients_;
    const std::function<void()> wake_;
    int spare_ = -1;  // a descriptor in reserve
    std::int64_t accepts_from_ns_ = 0;  // on the steady clock
    bool files_short_ = false;  // accept has failed because the process has no descriptor left
};

}  // namespace hal
