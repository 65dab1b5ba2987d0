// SPDX-License-Identifier: MIT
#include "control/server.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <limits>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include "hal/clock.hpp"
#include "machine/session.hpp"
#include "control/endpoint.hpp"
#include "control/connection.hpp"
#include "commands/shell.hpp"

namespace hal {
namespace {

constexpr std::size_t read_at_once = 65536;
constexpr std::int64_t no_files_ns = 100'000'000;          // before accept is tried again after the system had no file left
constexpr int lines_at_once = 1000;                        // of one client before the others have a turn
constexpr std::size_t slow_reader = std::size_t{64} << 10; // bytes waiting for a client that skip its subscriptions

/// One connected client. Used by the server's thread only, but for `result`, `finished` and `events` while a worker runs.
struct Client {
    Client(int f, Shell& shell, pid_t peer) : fd(f), connection(shell, peer) {}
    ~Client() {
        if (worker.joinable()) worker.join();
        close(fd);
    }
    Client(const Client&) = delete;

    int fd;
    Connection connection;
    std::string in, out;
    std::size_t taken = 0;         ///< bytes of `in` that are done with
    std::size_t searched = 0;      ///< up to here there is no end of line behind `taken`
    std::size_t sent = 0;          ///< bytes of `out` that have gone
    bool discarding = false;       ///< in the rest of a request that was too long
    bool gone = false;             ///< to be removed as soon as no worker runs
    std::int64_t stalled_since = 0; ///< since when a full queue has not moved; 0: it moves
    std::thread worker;            ///< runs a command that waits; until it has finished no other request is executed
    std::string result;            ///< of the worker
    std::atomic<bool> finished{false};
    bool stop_after = false;
    std::int64_t active_ns = monotonic_ns();  ///< when it connected or made its last request
    bool reserved = false;         ///< came when all places were taken
    std::mutex events_mutex;
    std::string events;            ///< that the worker has for the client meanwhile

    /// The place of the next end of line, or npos. Every byte is looked at once, however slowly a long line comes.
    std::size_t line_end() {
        const auto end = in.find('\n', std::max(taken, searched));
        searched = end == std::string::npos ? in.size() : end;
        return end;
    }
    bool busy() const { return worker.joinable(); }
    std::size_t waiting() const { return out.size() - sent; }
};

}  // namespace

struct Server::State {
    State(Shell& s, ServerOptions o) : shell(s), options(std::move(o)) {}

    Shell& shell;
    ServerOptions options;
    Endpoint endpoint;
    int wake = -1;                     ///< eventfd: a worker has finished, or the server is to end
    std::atomic<bool> ending{false};
    std::thread thread;
    std::int64_t accepts_from = 0;     ///< on the steady clock
    std::vector<std::unique_ptr<Client>> clients;
    std::atomic<std::uint64_t> connected{0}, accepted{0}, dropped{0}, reclaimed{0}, refused{0}, requests{0}, rubbish{0};

    void serve();
    int sleep_ms() const;
    void accept_clients();
    void receive(Client& client);
    void execute(Client& client);
    void execute_line(Client& client, std::string_view line);
    void look_for_cancel(Client& client);
    void collect_worker(Client& client);
    void reclaim();
    void close_idle(Client& client);
    void send_out(Client& client);
    void leave(Client& client);
    std::size_t places() const { return options.max_clients + options.reserved; }
    bool listens_to(const Client& client) const {
        return client.waiting() <= options.queue && client.in.size() - client.taken <= options.max_request;
    }
    void log(const std::string& sentence) const {
        if (options.log) options.log(sentence);
    }
};

Server::Server(Shell& shell, ServerOptions options) : state_(new State(shell, std::move(options))) {}

Server::~Server() {
    State& s = *state_;
    s.ending = true;
    if (s.wake >= 0) eventfd_write(s.wake, 1);
    if (s.thread.joinable()) s.thread.join();
    if (s.wake >= 0) close(s.wake);
}

bool Server::start(Diagnostics& diagnostics) {
    State& s = *state_;
    if (!s.endpoint.open(s.shell.session().options().name, diagnostics)) return false;
    s.wake = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    // Signals are for the program's own thread.
    sigset_t all, before;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    s.thread = std::thread([&s] { s.serve(); });
    pthread_sigmask(SIG_SETMASK, &before, nullptr);
    return true;
}

const std::string& Server::path() const { return state_->endpoint.path(); }

ServerCounts Server::counts() const {
    const State& s = *state_;
    return {s.connected, s.accepted, s.dropped, s.reclaimed, s.refused, s.requests, s.rubbish};
}

void Server::State::serve() {
    std::vector<pollfd> ready;
    while (!ending) {
        ready.clear();
        const bool accepts = clients.size() < places() && monotonic_ns() >= accepts_from;
        ready.push_back({endpoint.fd(), static_cast<short>(accepts ? POLLIN : 0), 0});
        ready.push_back({wake, POLLIN, 0});
        for (const auto& client : clients) {
            const int reads = listens_to(*client) ? POLLIN | POLLRDHUP : POLLRDHUP;
            ready.push_back({client->gone ? -1 : client->fd, static_cast<short>(reads | (client->waiting() > 0 ? POLLOUT : 0)), 0});
        }
        const int timeout = sleep_ms();
        poll(ready.data(), ready.size(), timeout);
        eventfd_t ignored;
        eventfd_read(wake, &ignored);

        const std::size_t before = clients.size();
        if (ready[0].revents & POLLIN) accept_clients();
        for (std::size_t i = 0; i < before; ++i) {
            Client& client = *clients[i];
            const short events = ready[i + 2].revents;
            collect_worker(client);
            if (client.gone) continue;
            if (events & POLLIN) receive(client);
            else if (events & (POLLHUP | POLLERR | POLLRDHUP)) leave(client);
            if (client.gone) continue;
            if (client.busy()) look_for_cancel(client);
            execute(client);
            if (const std::int64_t now = monotonic_ns(); client.connection.next_due_ns() <= now)
                client.connection.publish(now, client.waiting() > slow_reader, client.out);
            send_out(client);
        }
        std::erase_if(clients, [](const auto& client) { return client->gone && !client->busy(); });
        reclaim();
        connected = clients.size();
    }
    for (const auto& client : clients) {
        client->connection.cancel();
        if (client->busy()) {
            client->worker.join();
            client->out += client->result;
        }
        if (!client->gone) send_out(*client);
    }
    endpoint.stop_listening();
    clients.clear();
    connected = 0;
}

/// Time until the next subscription or client timeout is due; 0 while complete requests are pending.
int Server::State::sleep_ms() const {
    const std::int64_t now = monotonic_ns();
    std::int64_t until = accepts_from > now ? accepts_from : std::numeric_limits<std::int64_t>::max();
    for (const auto& client : clients) {
        if (client->gone) continue;
        if (!client->busy() && client->waiting() <= options.queue && client->line_end() != std::string::npos) return 0;
        until = std::min(until, client->connection.next_due_ns());
        if (client->stalled_since != 0) until = std::min(until, client->stalled_since + std::int64_t{options.stall_ms} * 1'000'000);
    }
    if (clients.size() > options.max_clients) until = std::min(until, now + std::int64_t{options.idle_ms} * 250'000);
    if (until == std::numeric_limits<std::int64_t>::max()) return -1;
    return until <= now ? 0 : static_cast<int>(std::min<std::int64_t>((until - now + 999'999) / 1'000'000, 60'000));
}

void Server::State::accept_clients() {
    while (clients.size() < places()) {
        const int fd = accept4(endpoint.fd(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
        if (fd < 0) {
            if (errno == EMFILE || errno == ENFILE || errno == ENOBUFS || errno == ENOMEM) accepts_from = monotonic_ns() + no_files_ns;
            return;
        }
        ucred peer{};
        socklen_t size = sizeof peer;
        if (getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0 || (peer.uid != geteuid() && peer.uid != 0)) {
            ++refused;
            log("rejected a client of user " + std::to_string(peer.uid));
            close(fd);
            continue;
        }
        ++accepted;
        clients.push_back(std::make_unique<Client>(fd, shell, peer.pid));
        Client& client = *clients.back();
        client.reserved = clients.size() > options.max_clients;
        client.connection.on_event([this, &client](std::string line) {
            const std::scoped_lock lock(client.events_mutex);
            client.events += line;
            eventfd_write(wake, 1);
        });
        client.out = client.connection.hello();
        send_out(client);
    }
}

/// While more clients are connected than there are places, those go that have been idle longest, and one in a reserved place that
/// keeps it from the next.
void Server::State::reclaim() {
    auto living = static_cast<std::size_t>(std::count_if(clients.begin(), clients.end(), [](const auto& client) { return !client->gone; }));
    if (living <= options.max_clients) {
        for (const auto& client : clients) client->reserved = false;
        return;
    }
    const std::int64_t now = monotonic_ns(), idle_ns = std::int64_t{options.idle_ms} * 1'000'000;
    for (; living > options.max_clients; --living) {
        Client* longest = nullptr;
        for (const auto& client : clients) {
            if (client->gone || now - client->active_ns < idle_ns || (longest && longest->active_ns <= client->active_ns)) continue;
            const bool in_the_way = client->reserved && living == places();
            const bool goes =
                client->busy() ? in_the_way && now - client->active_ns >= 10 * idle_ns : in_the_way || client->connection.idle();
            if (goes) longest = client.get();
        }
        if (!longest) return;
        close_idle(*longest);
    }
}

void Server::State::close_idle(Client& client) {
    ++reclaimed;
    const std::string idle = std::to_string((monotonic_ns() - client.active_ns) / 1'000'000'000) + " s";
    client.out += "{\"event\":\"closed\",\"reason\":\"more than " + std::to_string(options.max_clients) +
                  " clients are connected, and this one sent no request for " + idle + "\"}\n";
    send_out(client);
    log("disconnected a client without a request for " + idle + ": more than " + std::to_string(options.max_clients) + " clients are connected");
    leave(client);
    shutdown(client.fd, SHUT_RDWR);
}

void Server::State::receive(Client& client) {
    if (client.taken > 0) {
        client.in.erase(0, client.taken);
        client.taken = client.searched = 0;
    }
    std::array<char, read_at_once> part;
    const ssize_t got = recv(client.fd, part.data(), part.size(), 0);
    if (got == 0 || (got < 0 && errno != EAGAIN && errno != EINTR)) return leave(client);
    if (got < 0) return;
    std::string_view text(part.data(), static_cast<std::size_t>(got));
    if (client.discarding) {
        const auto end = text.find('\n');
        if (end == text.npos) return;
        client.discarding = false;
        text.remove_prefix(end + 1);
    }
    client.in += text;
    if (client.in.size() > options.max_request && client.line_end() == std::string::npos) {
        ++rubbish;
        client.out +=
            "{\"id\":null,\"ok\":false,\"error\":\"the request is longer than " + std::to_string(options.max_request) + " bytes\"}\n";
        client.in.clear();
        client.in.shrink_to_fit();
        client.searched = 0;
        client.discarding = true;
    }
}

/// A client that has gone: what it sent last is not executed, what its command waits for is not waited for.
void Server::State::leave(Client& client) {
    client.gone = true;
    client.connection.cancel();
}

void Server::State::execute(Client& client) {
    for (int lines = 0; lines < lines_at_once && !client.busy() && client.waiting() <= options.queue; ++lines) {
        const auto end = client.line_end();
        if (end == std::string::npos) break;
        std::string_view line(client.in.data() + client.taken, end - client.taken);
        if (line.ends_with('\r')) line.remove_suffix(1);
        client.taken = end + 1;
        if (!line.empty()) execute_line(client, line);
    }
    if (client.taken == client.in.size()) {
        client.in.clear();
        client.taken = client.searched = 0;
        if (client.in.capacity() > slow_reader) client.in.shrink_to_fit();
    }
}

void Server::State::execute_line(Client& client, std::string_view line) {
    const std::uint64_t requests_before = client.connection.requests(), rubbish_before = client.connection.rubbish();
    const auto count = [&] {
        requests += client.connection.requests() - requests_before;
        rubbish += client.connection.rubbish() - rubbish_before;
    };
    const auto handled = client.connection.handle(line, client.out);
    client.active_ns = monotonic_ns();
    count();
    if (handled == Connection::Handled::stop && options.stop) {
        send_out(client);
        options.stop();
    }
    if (handled != Connection::Handled::wants_thread) return;
    client.connection.cancel(false);
    client.finished = false;
    client.worker = std::thread([this, &client, request = std::string(line)] {
        client.connection.handle(request, client.result, true);
        ++requests;
        client.finished.store(true, std::memory_order_release);
        eventfd_write(wake, 1);
    });
}

void Server::State::look_for_cancel(Client& client) {
    for (std::size_t at = client.taken; at < client.in.size();) {
        const auto end = client.in.find('\n', at);
        if (end == std::string::npos || client.connection.cancels(std::string_view(client.in).substr(at, end - at))) return;
        at = end + 1;
    }
}

void Server::State::collect_worker(Client& client) {
    if (client.busy()) {
        const std::scoped_lock lock(client.events_mutex);
        client.out += std::exchange(client.events, {});
    }
    if (!client.busy() || !client.finished.load(std::memory_order_acquire)) return;
    client.worker.join();
    client.active_ns = monotonic_ns();
    client.connection.cancel(false);
    client.out += std::exchange(client.events, {});
    client.out += std::exchange(client.result, {});
}

void Server::State::send_out(Client& client) {
    const std::size_t before = client.sent;
    while (client.waiting() > 0) {
        const ssize_t gone = send(client.fd, client.out.data() + client.sent, client.waiting(), MSG_NOSIGNAL | MSG_DONTWAIT);
        if (gone < 0 && errno == EINTR) continue;
        if (gone < 0 && errno != EAGAIN && errno != EWOULDBLOCK) return leave(client);
        if (gone <= 0) break;
        client.sent += static_cast<std::size_t>(gone);
    }
    const bool moved = client.sent != before;
    if (client.waiting() == 0) {
        client.out.clear();
        if (client.out.capacity() > options.queue) client.out.shrink_to_fit();
        client.sent = 0;
    } else if (client.sent > options.queue) {
        client.out.erase(0, client.sent);
        client.sent = 0;
    }
    if (client.waiting() <= options.queue || moved) {
        client.stalled_since = client.waiting() > options.queue ? monotonic_ns() : 0;
        return;
    }
    const std::int64_t now = monotonic_ns();
    if (client.stalled_since == 0) client.stalled_since = now;
    if (now - client.stalled_since < std::int64_t{options.stall_ms} * 1'000'000) return;
    ++dropped;
    log("disconnected a client: " + std::to_string(client.waiting()) + " bytes of replies pending, nothing read for " +
        std::to_string(options.stall_ms) + " ms");
    leave(client);
}

}  // namespace hal
