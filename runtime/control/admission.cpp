// SPDX-License-Identifier: MIT
#include "control/admission.hpp"

#include <algorithm>
#include <cerrno>
#include <limits>
#include <optional>
#include <string>

#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include "commands/shell.hpp"
#include "control/client_group.hpp"

namespace hal {
namespace {

// before accept is tried again after the system had no file left
constexpr std::int64_t no_files_ns = 5'000'000;
// how long a client without a place has at least for an urgent request
constexpr std::int64_t urgent_ns = 20'000'000;
constexpr std::size_t max_waiting = 64;  // clients without a place
// a client without a place waits for one at most
constexpr std::int64_t give_up_ns = 5'000'000'000;

/// Returns whether accept() failed because files or memory are exhausted.
bool is_exhaustion(int error) {
    return error == EMFILE || error == ENFILE || error == ENOBUFS || error == ENOMEM;
}

int accept_client(int listener) {
    return accept4(listener, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
}

/// Returns true for a client that waits for a place.
bool waits(const ServedClient& client) { return !client.gone && !client.placed; }

/// Returns the wanted client with the earliest time; nullptr without a wanted one.
template <class Clients, class Wanted>
ServedClient* earliest(const Clients& clients, std::int64_t ServedClient::* time,
                       const Wanted& wanted) {
    ServedClient* found = nullptr;
    for (const auto& client : clients) {
        const bool earlier = !found || client.get()->*time < found->*time;
        if (earlier && wanted(*client)) {
            found = client.get();
        }
    }
    return found;
}

}  // namespace

Admission::~Admission() { close_spare(); }

void Admission::close_spare() {
    if (spare_ >= 0) {
        close(std::exchange(spare_, -1));
    }
}

std::int64_t Admission::next_due_ns(std::int64_t now_ns) const {
    std::int64_t due = std::numeric_limits<std::int64_t>::max();
    if (accepts_from_ns_ > now_ns) {
        due = accepts_from_ns_;
    }
    for (const auto& client : clients_.all()) {
        if (waits(*client)) {
            due = std::min(due, client->came_ns + give_up_ns);
        }
    }
    if (files_short_ || clients_.count(true) > options_.max_clients) {
        due = std::min(due, now_ns + std::int64_t{options_.idle_ms} * 250'000);
    }
    return due;
}

/// Watches the process that connected: a component must not outlive its process because a forked
/// child holds a copy of the socket. A process outside of the PID namespace, and one for which no
/// descriptor is left, cannot be watched.
void Admission::watch_process(ServedClient& client) {
    if (client.process >= 0 || client.process_ended || client.peer <= 0 || spare_ < 0) return;
    client.process = pidfd_of_peer(client.fd, client.peer, client.accepted_ns);
    if (client.process < 0 && errno == ESRCH) {
        note_process_end(client);
    }
}

void Admission::note_process_end(ServedClient& client) {
    if (client.process >= 0) {
        close(std::exchange(client.process, -1));
    }
    if (client.gone) return;
    client.process_ended = true;
    shutdown(client.fd, SHUT_RD);
}

/// Closes the descriptor by which the process of the newest watched client is watched: a client is
/// worth more than the watch of another. False when none is watched.
bool Admission::give_up_watch() {
    for (auto client = clients_.all().rbegin(); client != clients_.all().rend(); ++client) {
        if ((*client)->process < 0) continue;
        close(std::exchange((*client)->process, -1));
        return true;
    }
    return false;
}

void Admission::keep_spare() {
    if (spare_ < 0) {
        spare_ = eventfd(0, EFD_CLOEXEC);
    }
    if (spare_ >= 0) {
        files_short_ = false;
    }
}

/// Accepts a connection; with the descriptor in reserve when the process has no other. Returns -1
/// when no client waits, or it cannot be accepted.
int Admission::accept_one() {
    int fd = accept_client(endpoint_.fd());
    if (fd >= 0) return fd;
    if (!is_exhaustion(errno)) return -1;
    files_short_ = true;
    if (give_up_watch()) {
        fd = accept_client(endpoint_.fd());
        if (fd >= 0) return fd;
    }
    if (!close_one_idle(urgent_ns)) {
        close_spare();
    }
    fd = accept_client(endpoint_.fd());
    if (fd < 0) {
        accepts_from_ns_ = monotonic_ns() + no_files_ns;
    }
    return fd;
}

/// Returns the client that has been idle longest, for at least this time, and on which nothing
/// depends; nullptr without such a client.
ServedClient* Admission::max_idle(std::int64_t idle_ns) const {
    const std::int64_t now = monotonic_ns();
    return earliest(clients_.all(), &ServedClient::active_ns, [&](const ServedClient& client) {
        const bool occupied = client.gone || client.has_turn || client.busy() ||
                              client.halting_since != 0 || now - client.active_ns < idle_ns;
        return !occupied && (!client.placed || client.connection->idle());
    });
}

/// Closes the client that has been idle longest, for at least this time. Returns false without such
/// a client.
bool Admission::close_one_idle(std::int64_t idle_ns) {
    ServedClient* const idle = max_idle(idle_ns);
    if (!idle) return false;
    close_idle(*idle);
    return true;
}

/// Closes the client without a place that has been connected longest, if it had the time for an
/// urgent request. False without such a client.
bool Admission::make_way() {
    ServedClient* const oldest = earliest(
        clients_.all(), &ServedClient::came_ns,
        [](const ServedClient& client) { return waits(client) && client.halting_since == 0; });
    if (!oldest || monotonic_ns() - oldest->came_ns < urgent_ns) return false;
    ++reclaimed;
    clients_.close(*oldest, files_short_ ? "the machine has no file descriptor left"
                                         : "too many clients are connected");
    return true;
}

void Admission::accept_clients() {
    for (std::size_t i = 0; i < max_waiting; ++i) {
        if (clients_.count(true) >= places() && clients_.count(false) >= max_waiting &&
            !make_way()) {
            accepts_from_ns_ = monotonic_ns() + no_files_ns;
            return;
        }
        const int fd = accept_one();
        if (fd < 0) return;
        add_client(fd);
    }
}

void Admission::add_client(int fd) {
    ucred peer{};
    socklen_t size = sizeof peer;
    const bool is_known = getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &peer, &size) == 0;
    const bool is_own = is_known && (peer.uid == geteuid() || peer.uid == 0);
    const std::optional<gid_t> group = endpoint_.group();
    if (!is_own && !(is_known && group && is_peer_in_group(fd, *group))) {
        ++refused;
        clients_.log("rejected a client of user " + std::to_string(peer.uid));
        close(fd);
        return;
    }
    ++accepted;
    clients_.all().push_back(std::make_unique<ServedClient>(fd, shell_, peer.pid));
    ServedClient& client = *clients_.all().back();
    client.placed = spare_ >= 0 && clients_.count(true) < places();
    client.reserved = client.placed && clients_.count(true) > options_.max_clients;
    client.connection->on_event([this, &client](const std::string& line) {
        const std::scoped_lock lock(client.events_mutex);
        client.events += line;
        wake_();
    });
    client.out = client.connection->hello();
    clients_.send_out(client);
    if (!client.gone) {
        watch_process(client);
    }
}

void Admission::place_clients() {
    const std::int64_t now = monotonic_ns();
    for (const auto& client : clients_.all()) {
        if (!waits(*client)) continue;
        if (spare_ >= 0 && clients_.count(true) < places()) {
            client->placed = true;
            client->reserved = clients_.count(true) > options_.max_clients;
            watch_process(*client);
        } else if (now - client->came_ns >= give_up_ns) {
            ++refused;
            clients_.close(*client,
                           spare_ < 0 ? "the machine has no file descriptor left"
                                      : "too many clients are connected, and none of them is idle");
        }
    }
}

/// Returns true for a client that may be closed because more are connected than there are places.
/// `is_full`: the reserved places are taken, too.
bool Admission::may_reclaim(const ServedClient& client, bool is_full, std::int64_t idle_ns,
                            std::int64_t now_ns) const {
    const std::int64_t since_request_ns = now_ns - client.active_ns;
    if (client.gone || !client.placed || client.has_turn || since_request_ns < idle_ns) {
        return false;
    }
    const bool in_the_way = client.reserved && is_full;
    if (client.busy()) return in_the_way && since_request_ns >= 10 * idle_ns;
    return in_the_way || client.connection->idle();
}

void Admission::reclaim() {
    const std::int64_t now = monotonic_ns();
    const std::int64_t idle_ns = std::int64_t{options_.idle_ms} * 1'000'000;
    if (files_short_ && spare_ < 0) {
        close_one_idle(idle_ns);
    }
    std::size_t living = clients_.count(true);
    if (living <= options_.max_clients) {
        for (const auto& client : clients_.all()) {
            client->reserved = false;
        }
        return;
    }
    for (; living > options_.max_clients; --living) {
        const bool is_full = living == places();
        ServedClient* const idle = earliest(
            clients_.all(), &ServedClient::active_ns,
            [&](const ServedClient& client) { return may_reclaim(client, is_full, idle_ns, now); });
        if (!idle) return;
        close_idle(*idle);
    }
}

void Admission::close_idle(ServedClient& client) {
    ++reclaimed;
    const std::string idle =
        std::to_string((monotonic_ns() - client.active_ns) / 1'000'000'000) + " s";
    const std::string why =
        clients_.count(true) > options_.max_clients
            ? "more than " + std::to_string(options_.max_clients) + " clients are connected"
            : "the machine has no file descriptor left";
    clients_.close(client, why + ", and this one sent no request for " + idle);
    clients_.log("disconnected a client without a request for " + idle + ": " + why);
}

}  // namespace hal
