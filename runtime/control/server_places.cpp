// SPDX-License-Identifier: MIT
// Which clients the server accepts, and which it closes for others.
#include <cerrno>

#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "control/server_state.hpp"

namespace hal {
namespace {

// before accept is tried again after the system had no file left
constexpr std::int64_t no_files_ns = 5'000'000;
// how long a client without a place has at least for an urgent request
constexpr std::int64_t urgent_ns = 20'000'000;
constexpr std::size_t max_waiting = 64;                    // clients without a place

/// Opens a pidfd of the process at the other end of a socket; -1 with errno when it cannot be opened.
int pidfd_of_peer(int fd, pid_t pid) {
#ifdef SO_PEERPIDFD
    constexpr int peer_pidfd = SO_PEERPIDFD;
#else
    constexpr int peer_pidfd = 77;  // Linux 6.5
#endif
    int process = -1;
    socklen_t size = sizeof process;
    if (getsockopt(fd, SOL_SOCKET, peer_pidfd, &process, &size) == 0) return process;
    return static_cast<int>(syscall(SYS_pidfd_open, pid, 0));
}

}  // namespace

/// Watches the process that connected: a component must not outlive its process because a forked
/// child holds a copy of the socket. A process outside of the PID namespace, and one for which no
/// descriptor is left, cannot be watched.
void Server::State::watch_process(ServedClient& client) {
    if (client.process >= 0 || client.process_ended || client.peer <= 0 || spare < 0) return;
    client.process = pidfd_of_peer(client.fd, client.peer);
    if (client.process < 0 && errno == ESRCH) {
        note_process_end(client);
    }
}

/// The process that connected has ended: what it has sent is still read, then follows the end of
/// the connection, also for a child that holds a copy of the socket.
void Server::State::note_process_end(ServedClient& client) {
    if (client.process >= 0) {
        close(std::exchange(client.process, -1));
    }
    if (client.gone) return;
    client.process_ended = true;
    shutdown(client.fd, SHUT_RD);
}

/// Closes the descriptor by which the process of the newest watched client is watched: a client is
/// worth more than the watch of another. False when none is watched.
bool Server::State::give_up_watch() {
    for (auto client = clients.rbegin(); client != clients.rend(); ++client) {
        if ((*client)->process < 0) continue;
        close(std::exchange((*client)->process, -1));
        return true;
    }
    return false;
}

/// Opens the descriptor in reserve again, once no client uses it.
void Server::State::keep_spare() {
    if (spare < 0) {
        spare = eventfd(0, EFD_CLOEXEC);
    }
    if (spare >= 0) {
        files_short = false;
    }
}

/// Accepts a connection; with the descriptor in reserve when the process has no other. Returns -1
/// when no client waits, or it cannot be accepted.
int Server::State::accept_one() {
    int fd = accept4(endpoint.fd(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
    if (fd >= 0) return fd;
    if (errno != EMFILE && errno != ENFILE && errno != ENOBUFS && errno != ENOMEM) return -1;
    files_short = true;
    if (give_up_watch()) {
        fd = accept4(endpoint.fd(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
        if (fd >= 0) return fd;
    }
    if (!close_one_idle(urgent_ns) && spare >= 0) {
        close(std::exchange(spare, -1));
    }
    fd = accept4(endpoint.fd(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
    if (fd < 0) {
        accepts_from = monotonic_ns() + no_files_ns;
    }
    return fd;
}

/// Closes the client that has been idle longest, for at least this time. False without such a client.
bool Server::State::close_one_idle(std::int64_t idle_ns) {
    const std::int64_t now = monotonic_ns();
    ServedClient* longest = nullptr;
    for (const auto& client : clients) {
        const bool occupied = client->gone || client->has_turn || client->busy() ||
                              client->halting_since != 0 || now - client->active_ns < idle_ns;
        if (occupied || (longest && longest->active_ns <= client->active_ns)) continue;
        if (!client->placed || client->connection->idle()) {
            longest = client.get();
        }
    }
    if (!longest) return false;
    close_idle(*longest);
    return true;
}

/// Closes the client without a place that has been connected longest, if it had the time for an
/// urgent request. False without such a client.
bool Server::State::make_way() {
    ServedClient* oldest = nullptr;
    for (const auto& client : clients) {
        if (!client->gone && !client->placed && client->halting_since == 0 &&
            (!oldest || client->came_ns < oldest->came_ns)) {
            oldest = client.get();
        }
    }
    if (!oldest || monotonic_ns() - oldest->came_ns < urgent_ns) return false;
    ++reclaimed;
    close_client(*oldest, files_short ? "the machine has no file descriptor left"
                                      : "too many clients are connected");
    return true;
}

void Server::State::accept_clients() {
    for (std::size_t i = 0; i < max_waiting; ++i) {
        if (count(true) >= places() && count(false) >= max_waiting && !make_way()) {
            accepts_from = monotonic_ns() + no_files_ns;
            return;
        }
        const int fd = accept_one();
        if (fd < 0) return;
        add_client(fd);
    }
}

void Server::State::add_client(int fd) {
    ucred peer{};
    socklen_t size = sizeof peer;
    if (getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0 ||
        (peer.uid != geteuid() && peer.uid != 0)) {
        ++refused;
        log("rejected a client of user " + std::to_string(peer.uid));
        close(fd);
        return;
    }
    ++accepted;
    clients.push_back(std::make_unique<ServedClient>(fd, shell, peer.pid));
    ServedClient& client = *clients.back();
    client.placed = spare >= 0 && count(true) < places();
    client.reserved = client.placed && count(true) > options.max_clients;
    client.connection->on_event([this, &client](std::string line) {
        const std::scoped_lock lock(client.events_mutex);
        client.events += line;
        eventfd_write(wake, 1);
    });
    client.out = client.connection->hello();
    send_out(client);
    if (!client.gone) {
        watch_process(client);
    }
}

/// Gives free places to those who wait for one, in the order in which they came, and closes the
/// connection of those who have waited too long.
void Server::State::place_clients() {
    const std::int64_t now = monotonic_ns();
    for (const auto& client : clients) {
        if (client->gone || client->placed) continue;
        if (spare >= 0 && count(true) < places()) {
            client->placed = true;
            client->reserved = count(true) > options.max_clients;
            watch_process(*client);
        } else if (now - client->came_ns >= give_up_ns) {
            ++refused;
            close_client(*client, spare < 0
                                      ? "the machine has no file descriptor left"
                                      : "too many clients are connected, and none of them is idle");
        }
    }
}

/// While more clients are connected than there are places, those go that have been idle longest,
/// and one in a reserved place that keeps it from the next. When the process has no descriptor
/// left, an idle client goes, too.
void Server::State::reclaim() {
    std::size_t living = count(true);
    const std::int64_t now = monotonic_ns();
    const std::int64_t idle_ns = std::int64_t{options.idle_ms} * 1'000'000;
    if (files_short && spare < 0) {
        close_one_idle(idle_ns);
    }
    if (living <= options.max_clients) {
        for (const auto& client : clients) {
            client->reserved = false;
        }
        return;
    }
    for (; living > options.max_clients; --living) {
        ServedClient* longest = nullptr;
        for (const auto& client : clients) {
            if (client->gone || !client->placed || client->has_turn ||
                now - client->active_ns < idle_ns) {
                continue;
            }
            if (longest && longest->active_ns <= client->active_ns) continue;
            const bool in_the_way = client->reserved && living == places();
            const bool goes = client->busy() ? in_the_way && now - client->active_ns >= 10 * idle_ns
                                             : in_the_way || client->connection->idle();
            if (goes) {
                longest = client.get();
            }
        }
        if (!longest) return;
        close_idle(*longest);
    }
}

void Server::State::close_idle(ServedClient& client) {
    ++reclaimed;
    const std::string idle =
        std::to_string((monotonic_ns() - client.active_ns) / 1'000'000'000) + " s";
    const std::string why =
        count(true) > options.max_clients
            ? "more than " + std::to_string(options.max_clients) + " clients are connected"
            : "the machine has no file descriptor left";
    close_client(client, why + ", and this one sent no request for " + idle);
    log("disconnected a client without a request for " + idle + ": " + why);
}

void Server::State::close_client(ServedClient& client, const std::string& reason) {
    client.out += "{\"event\":\"closed\",\"reason\":\"" + reason + "\"}\n";
    send_out(client);
    if (client.gone) return;
    shutdown(client.fd, SHUT_RDWR);
    leave(client);
}

}  // namespace hal
