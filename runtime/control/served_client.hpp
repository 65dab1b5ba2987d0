// SPDX-License-Identifier: MIT
// One client of the server, and its turn with an executor. Internal to the server.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>

#include <unistd.h>

#include "control/connection.hpp"
#include "control/peer_process.hpp"
#include "hal/clock.hpp"

namespace hal {

// bytes waiting for a client that skip its subscriptions
constexpr std::size_t slow_reader = std::size_t{64} << 10;

/// What a client has an executor do: its next requests, then its subscriptions. Filled by the
/// server's thread, carried out by an executor.
struct Turn {
    std::string lines;             ///< complete requests; afterwards those that remain
    /// a request that needs a thread of its own; it was not executed
    std::string waiting;
    std::string replies;
    /// of replies: when they are longer the remaining requests are left for later
    std::size_t capacity = 0;
    bool congested = false;        ///< subscriptions are skipped
    bool stop = false;             ///< a request asked the instance to end
    bool told_end = false;         ///< as Connection::told_end()
    /// the client is gone: the connection is closed, which may take long
    bool closes = false;
    std::uint64_t requests = 0;
    std::uint64_t invalid = 0;  ///< lines that were not requests
};

/// One connected client. Used by the server's thread only, except for `result`, `finished` and
/// `events` while a worker runs, and `turn` and `connection` while the client has a turn.
struct ServedClient {
    ServedClient(int f, Shell& shell, pid_t client)
        : fd(f), peer(client), connection(std::make_unique<Connection>(shell, client)) {}
    ~ServedClient() {
        if (worker.joinable()) {
            worker.join();
        }
        if (fd >= 0) {
            close(fd);
        }
        if (process >= 0) {
            close(process);
        }
    }
    ServedClient(const ServedClient&) = delete;

    int fd;                        ///< -1 once it is gone
    const pid_t peer;  ///< the process that connected; 0: in no PID namespace of ours
    /// pidfd of the process that connected; -1: it has ended, or cannot be watched
    int process = -1;
    /// the process has ended; a child may hold a copy of its socket
    bool process_ended = false;
    std::unique_ptr<Connection> connection;
    std::string in, out;
    std::size_t taken = 0;  ///< bytes of `in` that are done with
    std::size_t searched = 0;  ///< up to here there is no end of line behind `taken`
    std::size_t sent = 0;  ///< bytes of `out` that have gone
    /// it sends no more requests, but may still read replies
    bool input_ended = false;
    bool discarding = false;  ///< in the rest of a request that was too long
    /// to be removed as soon as no worker runs and its connection is closed
    bool gone = false;
    bool has_turn = false;  ///< the turn is queued or being carried out
    /// it counts among the places; others have urgent requests executed only
    bool placed = false;
    bool not_urgent = false;  ///< the next request has been looked at
    /// A request was rejected because the machine ends. Further ones are not read, so that many
    /// clients do not delay the end.
    bool told_end = false;
    std::int64_t stalled_since = 0;  ///< since when a full queue has not moved; 0: it moves
    /// since when its next request, a `stop`, waits for the threads; 0: it does not
    std::int64_t halting_since = 0;
    /// runs a command that waits; until it has finished no other request is executed
    std::thread worker;
    std::string result;  ///< of the worker
    std::atomic<bool> finished{false};
    Turn turn;
    std::atomic<bool> turn_over{false};
    std::int64_t came_ns = monotonic_ns();
    /// when it was accepted, on the clock of pidfd_of_peer()
    std::int64_t accepted_ns = boot_ns();
    std::int64_t active_ns = came_ns;  ///< when it connected or made its last request
    bool reserved = false;  ///< came when all places were taken
    std::mutex events_mutex;
    std::string events;  ///< that the worker has for the client meanwhile

    /// The place of the next end of line, or npos. Every byte is looked at once, however slowly a
    /// long line comes.
    std::size_t line_end() {
        const auto end = in.find('\n', std::max(taken, searched));
        searched = end == std::string::npos ? in.size() : end;
        return end;
    }
    /// The next request, without its end of line, which is at `end`.
    std::string_view line(std::size_t end) const {
        const std::string_view text(in.data() + taken, end - taken);
        return text.ends_with('\r') ? text.substr(0, text.size() - 1) : text;
    }
    void done_up_to(std::size_t offset) {
        taken = offset;
        not_urgent = false;
        halting_since = 0;
        if (taken < in.size()) return;
        in.clear();
        taken = 0;
        searched = 0;
        if (in.capacity() > slow_reader) {
            in.shrink_to_fit();
        }
    }
    bool busy() const { return worker.joinable(); }
    /// True when its process has ended and all that it has sent was read: these requests are
    /// executed, but none of them waits.
    bool is_abandoned() const { return process_ended && input_ended; }
    /// Drops the replies that are pending.
    void discard_replies() {
        out.clear();
        sent = 0;
        stalled_since = 0;
    }
    /// True when all its requests have been executed, and all replies have gone.
    bool is_served() {
        return !busy() && !has_turn && halting_since == 0 && waiting() == 0 &&
               line_end() == std::string::npos;
    }
    std::size_t waiting() const { return out.size() - sent; }
};

}  // namespace hal
