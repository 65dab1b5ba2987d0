// SPDX-License-Identifier: MIT
#include "control/server.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <limits>
#include <thread>
#include <utility>
#include <vector>

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include "base/keep.hpp"
#include "base/own_descriptors.hpp"
#include "base/poll_all.hpp"
#include "commands/shell.hpp"
#include "control/admission.hpp"
#include "control/client_list.hpp"
#include "control/endpoint.hpp"
#include "control/executors.hpp"
#include "execute/process_setup.hpp"
#include "machine/session.hpp"

namespace hal {
namespace {

constexpr std::size_t read_at_once = 65536;
// between two looks whether the threads have stopped
constexpr std::int64_t halt_poll_ns = 500'000;
// before the ordinary `stop` reports which thread does not
constexpr std::int64_t halt_timeout_ns = 1'000'000'000;
// of one client before the others have a turn
constexpr int lines_at_once = 1000;

}  // namespace

// Two kinds of threads: the server's own accepts, reads and writes, and executes what must not wait
// (`stop`, `options`); executors do all the rest. The server's thread takes no lock of the session,
// so whatever clients do, the next `stop` is seen at once.
struct Server::State {
    State(Shell& s, ServerOptions o) : shell(s), options(std::move(o)) {}

    void serve();
    void serve_client(ServedClient& client, short events);
    void end_all();
    int sleep_ms();
    bool has_work(ServedClient& client);
    std::int64_t next_due_ns(ServedClient& client);
    std::int64_t next_due_ns(std::int64_t now_ns);
    void receive(ServedClient& client, bool hung_up);
    void reject_too_long(ServedClient& client);
    void execute(ServedClient& client);
    bool execute_urgent(ServedClient& client);
    void give_turn(ServedClient& client);
    void collect_turn(ServedClient& client);
    void start_worker(ServedClient& client, std::string request);
    void look_for_cancel(ServedClient& client);
    void collect_worker(ServedClient& client);
    void remove_gone();

    Shell& shell;
    const ServerOptions options;
    Endpoint endpoint;
    /// eventfd: a worker or an executor has finished, or the server is to end
    int wake = -1;
    std::atomic<bool> ending{false};
    /// the kernel closes the connections; set before the server ends, read by its thread then
    std::atomic<bool> closes_at_exit{false};
    std::thread thread;
    ClientList clients{options};
    Admission admission{shell, options, endpoint, clients, [this] { eventfd_write(wake, 1); }};
    Executors pool{[this] { eventfd_write(wake, 1); },
                   [this] { return ending || shell.session().ending(); }};
    // written by the server's thread
    std::atomic<std::uint64_t> connected{0};
    std::atomic<std::uint64_t> requests{0};
    std::atomic<std::uint64_t> invalid_requests{0};
};

Server::Server(Shell& shell, ServerOptions options)
    : state_(new State(shell, std::move(options))) {}

Server::~Server() {
    State& s = *state_;
    s.ending = true;
    if (s.wake >= 0) {
        eventfd_write(s.wake, 1);
    }
    if (s.thread.joinable()) {
        s.thread.join();
    }
    if (s.wake >= 0) {
        close_own(s.wake);
    }
}

bool Server::start(Diagnostics& diagnostics) {
    State& s = *state_;
    const std::string& name = s.shell.session().options().name;
    if (!s.endpoint.open(name, s.options.group, diagnostics)) return false;
    s.wake = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    list_descriptor(s.wake, "the wake-up of the control server");
    // Signals are for the program's own thread.
    sigset_t all, before;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    s.thread = std::thread([&s] { s.serve(); });
    pthread_sigmask(SIG_SETMASK, &before, nullptr);
    return true;
}

void Server::close_at_exit() { state_->closes_at_exit = true; }

const std::string& Server::path() const { return state_->endpoint.path(); }

ServerCounts Server::counts() const {
    const State& s = *state_;
    return {s.connected,         s.admission.accepted, s.clients.dropped, s.admission.reclaimed,
            s.admission.refused, s.requests,           s.invalid_requests};
}

/// The server's thread: accepts clients, serves their requests and notes the end of their
/// processes, until the server ends.
void Server::State::serve() {
    release_unused_stack();
    pool.start();
    admission.keep_spare();
    std::vector<pollfd> ready;
    std::vector<ServedClient*> watched;  // whose process is in `ready`, behind the sockets
    while (!ending) {
        ready.clear();
        watched.clear();
        const short accepts = admission.accepts(monotonic_ns()) ? POLLIN : 0;
        ready.push_back({endpoint.fd(), accepts, 0});
        ready.push_back({wake, POLLIN, 0});
        for (const auto& client : clients.all()) {
            const short reads = clients.listens_to(*client) ? POLLIN : 0;
            const short writes = client->waiting() > 0 ? POLLOUT : 0;
            const int fd = client->gone ? -1 : client->fd;
            ready.push_back({fd, static_cast<short>(reads | writes), 0});
            if (client->process >= 0) {
                watched.push_back(client.get());
            }
        }
        const std::size_t before = clients.all().size();
        for (const ServedClient* client : watched) {
            ready.push_back({client->process, POLLIN, 0});
        }
        const int sleep = sleep_ms();
        const timespec timeout{sleep / 1000, sleep % 1000 * 1'000'000L};
        poll_all(ready, sleep < 0 ? nullptr : &timeout);
        eventfd_t ignored;
        eventfd_read(wake, &ignored);

        if (ready[0].revents & POLLIN) {
            admission.accept_clients();
        }
        for (std::size_t i = 0; i < watched.size(); ++i) {
            if (ready[2 + before + i].revents != 0) {
                admission.note_process_end(*watched[i]);
            }
        }
        for (std::size_t i = 0; i < before; ++i) {
            serve_client(*clients.all()[i], ready[2 + i].revents);
        }
        remove_gone();
        admission.reclaim();
        admission.place_clients();
        admission.keep_spare();
        connected = clients.all().size();
    }
    end_all();
}

void Server::State::serve_client(ServedClient& client, short events) {
    collect_turn(client);
    collect_worker(client);
    if (client.gone) return;
    if (events & POLLIN) {
        receive(client, (events & POLLHUP) != 0);
    } else if (events & (POLLHUP | POLLERR)) {
        clients.leave(client);
    }
    if (client.gone) return;
    if (client.busy()) {
        look_for_cancel(client);
    }
    if (client.busy() && client.is_abandoned()) {
        client.connection->cancel();
    }
    execute(client);
    if (!client.gone) {
        clients.send_out(client);
    }
    if (client.process_ended) {
        client.discard_replies();
    }
    if (!client.gone && client.input_ended && client.is_served()) {
        clients.leave(client);
    }
}

void Server::State::remove_gone() {
    for (const auto& client : clients.all()) {
        if (!client->gone || client->busy() || client->has_turn || !client->connection) continue;
        client->turn = {};
        client->turn.closes = true;
        client->has_turn = true;
        client->turn_over = false;
        pool.give(*client);
    }
    std::erase_if(clients.all(), [](const auto& client) {
        return client->gone && !client->busy() && !client->has_turn && !client->connection;
    });
}

void Server::State::end_all() {
    for (const auto& client : clients.all()) {
        const bool is_being_closed = client->turn.closes;  // an executor has the connection
        if (!is_being_closed && client->connection) {
            client->connection->cancel();
        }
    }
    pool.end();
    for (const auto& client : clients.all()) {
        if (client->has_turn) {
            client->out += client->turn.replies;
        }
        if (client->busy()) {
            client->worker.join();
            client->out += client->result;
        }
        if (!client->gone) {
            clients.send_out(*client);
        }
    }
    endpoint.stop_listening();
    if (closes_at_exit) {
        keep_for_good(std::make_unique<ClientList::Clients>(std::move(clients.all())));
    }
    clients.all().clear();
    admission.close_spare();
    connected = 0;
}

/// When the next subscription of the client is due; never while it has a turn, at whose end they
/// are sent.
std::int64_t Server::State::next_due_ns(ServedClient& client) {
    return client.gone || client.has_turn ? std::numeric_limits<std::int64_t>::max()
                                          : client.connection->next_due_ns();
}

/// True when the client's next request can be executed now.
bool Server::State::has_work(ServedClient& client) {
    if (client.gone || client.busy() || client.has_turn || client.told_end ||
        client.halting_since != 0 || client.waiting() > options.queue) {
        return false;
    }
    return client.line_end() != std::string::npos && (client.placed || !client.not_urgent);
}

/// When the server's thread has to look at its clients again.
std::int64_t Server::State::next_due_ns(std::int64_t now_ns) {
    std::int64_t due = admission.next_due_ns(now_ns);
    for (const auto& client : clients.all()) {
        if (client->gone) continue;
        if (has_work(*client)) return now_ns;
        due = std::min(due, next_due_ns(*client));
        if (client->halting_since != 0) {
            due = std::min(due, now_ns + halt_poll_ns);
        }
        if (client->stalled_since != 0) {
            const std::int64_t stall_ns = std::int64_t{options.stall_ms} * 1'000'000;
            due = std::min(due, client->stalled_since + stall_ns);
        }
    }
    return due;
}

/// Time until the next subscription or client timeout is due; 0 while complete requests are
/// pending; -1: no limit.
int Server::State::sleep_ms() {
    const std::int64_t now = monotonic_ns();
    const std::int64_t due = next_due_ns(now);
    if (due == std::numeric_limits<std::int64_t>::max()) return -1;
    if (due <= now) return 0;
    constexpr std::int64_t max_ms = 60'000;
    return static_cast<int>(std::min((due - now + 999'999) / 1'000'000, max_ms));
}

/// `hung_up`: the client has closed both directions.
void Server::State::receive(ServedClient& client, bool hung_up) {
    if (client.taken > 0) {
        client.in.erase(0, client.taken);
        client.taken = 0;
        client.searched = 0;
    }
    std::array<char, read_at_once> part;
    const ssize_t got = recv(client.fd, part.data(), part.size(), 0);
    if (got < 0 && errno != EAGAIN && errno != EINTR) return clients.leave(client);
    if (got == 0 && hung_up) return clients.leave(client);
    if (got == 0) {
        client.input_ended = true;
        return;
    }
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
        reject_too_long(client);
    }
}

/// Rejects a request of which there is no end yet; the rest of it is discarded.
void Server::State::reject_too_long(ServedClient& client) {
    ++invalid_requests;
    client.out += "{\"id\":null,\"ok\":false,\"error\":\"the request is longer than " +
                  std::to_string(options.max_request) + " bytes\"}\n";
    client.in.clear();
    client.in.shrink_to_fit();
    client.searched = 0;
    client.discarding = true;
}

void Server::State::execute(ServedClient& client) {
    while (has_work(client) && execute_urgent(client)) {
    }
    if (client.gone || client.has_turn) return;
    if (client.halting_since != 0 && !execute_urgent(client)) return;
    if ((client.placed && has_work(client)) || next_due_ns(client) <= monotonic_ns()) {
        give_turn(client);
    }
}

/// Executes the client's next request if it must not wait. False when it is not such a request, or
/// not done yet.
bool Server::State::execute_urgent(ServedClient& client) {
    const std::size_t end = client.line_end();
    const std::string_view line = client.line(end);
    if (line.empty()) {
        client.done_up_to(end + 1);
        return true;
    }
    if (client.not_urgent) return false;
    const std::uint64_t before = client.connection->requests();
    const std::int64_t now = monotonic_ns();
    auto done = client.halting_since != 0 ? client.connection->halted(line, client.out)
                                          : client.connection->execute_urgent(line, client.out);
    if (done == Connection::Urgent::halting) {
        if (client.halting_since == 0) {
            client.halting_since = now;
        }
        if (now - client.halting_since < halt_timeout_ns) return false;
        done = Connection::Urgent::lost;
    }
    if (done == Connection::Urgent::no || done == Connection::Urgent::lost) {
        client.not_urgent = true;
        client.halting_since = 0;
        return false;
    }
    requests += client.connection->requests() - before;
    client.active_ns = now;
    client.done_up_to(end + 1);
    if (done == Connection::Urgent::stop && options.stop) {
        clients.send_out(client);
        options.stop();
    }
    return true;
}

/// Hands the client's complete requests over to the executors.
void Server::State::give_turn(ServedClient& client) {
    Turn& turn = client.turn;
    turn = {};
    if (has_work(client)) {
        std::size_t end = client.taken;
        for (int lines = 0; lines < lines_at_once; ++lines) {
            const std::size_t next = client.in.find('\n', end);
            if (next == std::string::npos) break;
            end = next + 1;
        }
        turn.lines = client.in.substr(client.taken, end - client.taken);
        turn.capacity = options.queue - client.waiting();
        client.done_up_to(end);
    }
    turn.congested = client.waiting() > slow_reader;
    client.connection->reserve(client.reserved ? options.max_clients : 0);
    client.has_turn = true;
    client.turn_over = false;
    pool.give(client);
}

void Server::State::collect_turn(ServedClient& client) {
    if (!client.has_turn || !client.turn_over.load(std::memory_order_acquire)) return;
    client.has_turn = false;
    Turn& turn = client.turn;
    if (turn.closes) return;
    client.told_end = client.told_end || turn.told_end;
    if (turn.requests + turn.invalid > 0) {
        client.active_ns = monotonic_ns();
    }
    requests += turn.requests;
    invalid_requests += turn.invalid;
    if (!client.busy()) {
        const std::scoped_lock lock(client.events_mutex);
        client.out += std::exchange(client.events, {});
    }
    client.out += turn.replies;
    turn.replies = {};
    if (!turn.lines.empty()) {
        client.in.replace(0, client.taken, turn.lines);
        client.taken = 0;
        client.searched = 0;
        turn.lines = {};
    }
    if (turn.stop && options.stop) {
        if (!client.gone) {
            clients.send_out(client);
        }
        options.stop();
    }
    if (turn.waiting.empty()) return;
    start_worker(client, std::exchange(turn.waiting, {}));
    if (client.gone) {
        client.connection->cancel();  // what it waits for is not waited for
    }
}

void Server::State::start_worker(ServedClient& client, std::string request) {
    client.active_ns = monotonic_ns();
    client.connection->cancel(false);
    client.finished = false;
    client.worker = std::thread([this, &client, line = std::move(request)] {
        release_unused_stack();
        client.connection->handle(line, client.result, true);
        ++requests;
        client.finished.store(true, std::memory_order_release);
        eventfd_write(wake, 1);
    });
}

void Server::State::look_for_cancel(ServedClient& client) {
    for (std::size_t at = client.taken; at < client.in.size();) {
        const auto end = client.in.find('\n', at);
        if (end == std::string::npos ||
            client.connection->cancels(std::string_view(client.in).substr(at, end - at))) {
            return;
        }
        at = end + 1;
    }
}

void Server::State::collect_worker(ServedClient& client) {
    if (client.busy()) {
        const std::scoped_lock lock(client.events_mutex);
        client.out += std::exchange(client.events, {});
    }
    if (!client.busy() || !client.finished.load(std::memory_order_acquire)) return;
    client.worker.join();
    client.active_ns = monotonic_ns();
    if (!client.gone) {
        client.connection->cancel(false);
    }
    client.out += std::exchange(client.events, {});
    client.out += std::exchange(client.result, {});
}

}  // namespace hal
