// SPDX-License-Identifier: MIT
#include "control/server.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <condition_variable>
#include <csignal>
#include <deque>
#include <functional>
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
constexpr std::int64_t no_files_ns = 5'000'000;            // before accept is tried again after the system had no file left
constexpr std::int64_t urgent_ns = 20'000'000;             // how long a client without a place has at least for an urgent request
constexpr std::int64_t halt_poll_ns = 500'000;             // between two looks whether the threads have stopped
constexpr std::int64_t halt_timeout_ns = 1'000'000'000;    // before the ordinary `stop` says which thread does not
constexpr std::int64_t give_up_ns = 5'000'000'000;         // a client without a place waits so long for one
constexpr int lines_at_once = 1000;                        // of one client before the others have a turn
constexpr std::size_t slow_reader = std::size_t{64} << 10; // bytes waiting for a client that skip its subscriptions
constexpr std::size_t max_waiting = 64;                    // clients without a place
constexpr std::size_t executors = 2;                       // threads that execute requests

/// What a client has an executor do: its next requests, then its subscriptions. Filled by the server's thread, carried out by an executor.
struct Turn {
    std::string lines;             ///< complete requests; afterwards those that remain
    std::string waiting;           ///< a request that needs a thread of its own; it was not executed
    std::string replies;
    std::size_t capacity = 0;      ///< of replies: when they are longer the remaining requests are left for later
    bool congested = false;        ///< subscriptions are skipped
    bool stop = false;             ///< a request asked the instance to end
    bool closes = false;           ///< the client is gone: the connection is closed, which may take long
    std::uint64_t requests = 0, rubbish = 0;
};

/// One connected client. Used by the server's thread only, but for `result`, `finished` and `events` while a worker runs, and `turn` and
/// `connection` while the client has a turn.
struct Client {
    Client(int f, Shell& shell, pid_t peer) : fd(f), connection(std::make_unique<Connection>(shell, peer)) {}
    ~Client() {
        if (worker.joinable()) worker.join();
        if (fd >= 0) close(fd);
    }
    Client(const Client&) = delete;

    int fd;                        ///< -1 once it is gone
    std::unique_ptr<Connection> connection;
    std::string in, out;
    std::size_t taken = 0;         ///< bytes of `in` that are done with
    std::size_t searched = 0;      ///< up to here there is no end of line behind `taken`
    std::size_t sent = 0;          ///< bytes of `out` that have gone
    bool discarding = false;       ///< in the rest of a request that was too long
    bool gone = false;             ///< to be removed as soon as no worker runs and its connection is closed
    bool has_turn = false;         ///< the turn is queued or being carried out
    bool placed = false;           ///< it counts among the places; others have urgent requests executed only
    bool not_urgent = false;       ///< the next request has been looked at
    std::int64_t stalled_since = 0; ///< since when a full queue has not moved; 0: it moves
    std::int64_t halting_since = 0; ///< since when its next request, a `stop`, waits for the threads; 0: it does not
    std::thread worker;            ///< runs a command that waits; until it has finished no other request is executed
    std::string result;            ///< of the worker
    std::atomic<bool> finished{false};
    Turn turn;
    std::atomic<bool> turn_over{false};
    std::int64_t came_ns = monotonic_ns();
    std::int64_t active_ns = came_ns;  ///< when it connected or made its last request
    bool reserved = false;         ///< came when all places were taken
    std::mutex events_mutex;
    std::string events;            ///< that the worker has for the client meanwhile

    /// The place of the next end of line, or npos. Every byte is looked at once, however slowly a long line comes.
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
    void done_up_to(std::size_t place) {
        taken = place;
        not_urgent = false;
        halting_since = 0;
        if (taken < in.size()) return;
        in.clear();
        taken = searched = 0;
        if (in.capacity() > slow_reader) in.shrink_to_fit();
    }
    bool busy() const { return worker.joinable(); }
    std::size_t waiting() const { return out.size() - sent; }
};

/// Carries out the turns of clients, in the order in which they were given. A turn may wait for the session's lock for long: the server's thread
/// never does.
class Executors {
public:
    explicit Executors(std::function<void()> told) : told_(std::move(told)) {}
    ~Executors() { end(); }
    void start() {
        for (std::size_t i = 0; i < executors; ++i) threads_.emplace_back([this] { work(); });
    }
    void give(Client& client) {
        {
            const std::scoped_lock lock(mutex_);
            queue_.push_back(&client);
        }
        wake_.notify_one();
    }
    /// Ends the threads after their present turns.
    void end() {
        {
            const std::scoped_lock lock(mutex_);
            ending_ = true;
        }
        wake_.notify_all();
        for (std::thread& thread : threads_) thread.join();
        threads_.clear();
    }

private:
    void work() {
        for (;;) {
            Client* client = nullptr;
            {
                std::unique_lock lock(mutex_);
                wake_.wait(lock, [this] { return ending_ || !queue_.empty(); });
                if (ending_) return;
                client = queue_.front();
                queue_.pop_front();
            }
            carry_out(*client);
            client->turn_over.store(true, std::memory_order_release);
            told_();
        }
    }

    static void carry_out(Client& client) {
        Turn& turn = client.turn;
        if (turn.closes) return client.connection.reset();
        Connection& connection = *client.connection;
        const std::uint64_t requests = connection.requests(), rubbish = connection.rubbish();
        std::size_t taken = 0;
        while (taken < turn.lines.size() && turn.replies.size() <= turn.capacity && turn.waiting.empty() && !turn.stop) {
            const std::size_t end = turn.lines.find('\n', taken);
            std::string_view line = std::string_view(turn.lines).substr(taken, end - taken);
            if (line.ends_with('\r')) line.remove_suffix(1);
            taken = end + 1;
            if (line.empty()) continue;
            const auto handled = connection.handle(line, turn.replies);
            turn.stop = handled == Connection::Handled::stop;
            if (handled == Connection::Handled::wants_thread) turn.waiting = line;
        }
        turn.lines.erase(0, taken);
        turn.requests = connection.requests() - requests;
        turn.rubbish = connection.rubbish() - rubbish;
        if (const std::int64_t now = monotonic_ns(); connection.next_due_ns() <= now) connection.publish(now, turn.congested, turn.replies);
    }

    std::function<void()> told_;
    std::mutex mutex_;
    std::condition_variable wake_;
    std::deque<Client*> queue_;   // guarded by mutex_
    bool ending_ = false;         // guarded by mutex_
    std::vector<std::thread> threads_;
};

}  // namespace

// Two kinds of threads: the server's own accepts, reads and writes, and executes what must not wait (`stop`, `options`); executors do all the rest.
// The server's thread takes no lock of the session, so whatever clients do, the next `stop` is seen at once. For that a client gets in when
// all places are taken, and with the descriptor that is kept in reserve when the process has no other.
struct Server::State {
    State(Shell& s, ServerOptions o) : shell(s), options(std::move(o)) {}

    Shell& shell;
    ServerOptions options;
    Endpoint endpoint;
    int wake = -1;                     ///< eventfd: a worker or an executor has finished, or the server is to end
    int spare = -1;                    ///< a descriptor in reserve
    std::atomic<bool> ending{false};
    std::thread thread;
    std::int64_t accepts_from = 0;     ///< on the steady clock
    bool files_short = false;          ///< accept has failed because the process has no descriptor left
    std::vector<std::unique_ptr<Client>> clients;
    Executors pool{[this] { eventfd_write(wake, 1); }};
    std::atomic<std::uint64_t> connected{0}, accepted{0}, dropped{0}, reclaimed{0}, refused{0}, requests{0}, rubbish{0};

    void serve();
    void serve_client(Client& client, short events);
    void end_all();
    int sleep_ms();
    bool has_work(Client& client);
    std::int64_t next_due_ns(Client& client);
    void accept_clients();
    void add_client(int fd);
    int accept_one();
    bool close_one_idle(std::int64_t idle_ns);
    void keep_spare();
    bool make_way();
    void receive(Client& client);
    void execute(Client& client);
    bool execute_urgent(Client& client);
    void give_turn(Client& client);
    void collect_turn(Client& client);
    void start_worker(Client& client, std::string request);
    void look_for_cancel(Client& client);
    void collect_worker(Client& client);
    void place_clients();
    void reclaim();
    void close_idle(Client& client);
    void close_client(Client& client, const std::string& reason);
    void send_out(Client& client);
    void leave(Client& client);
    void remove_gone();
    std::size_t places() const { return options.max_clients + options.reserved; }
    std::size_t count(bool placed) const {
        return static_cast<std::size_t>(
            std::count_if(clients.begin(), clients.end(), [&](const auto& client) { return !client->gone && client->placed == placed; }));
    }
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
    pool.start();
    keep_spare();
    std::vector<pollfd> ready;
    while (!ending) {
        ready.clear();
        ready.push_back({endpoint.fd(), static_cast<short>(monotonic_ns() >= accepts_from ? POLLIN : 0), 0});
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
        for (std::size_t i = 0; i < before; ++i) serve_client(*clients[i], ready[i + 2].revents);
        remove_gone();
        reclaim();
        place_clients();
        keep_spare();
        connected = clients.size();
    }
    end_all();
}

void Server::State::serve_client(Client& client, short events) {
    collect_turn(client);
    collect_worker(client);
    if (client.gone) return;
    if (events & POLLIN) receive(client);
    else if (events & (POLLHUP | POLLERR | POLLRDHUP)) leave(client);
    if (client.gone) return;
    if (client.busy()) look_for_cancel(client);
    execute(client);
    if (!client.gone) send_out(client);
}

void Server::State::remove_gone() {
    for (const auto& client : clients) {
        if (!client->gone || client->busy() || client->has_turn || !client->connection) continue;
        client->turn = {};
        client->turn.closes = client->has_turn = true;
        client->turn_over = false;
        pool.give(*client);
    }
    std::erase_if(clients, [](const auto& client) { return client->gone && !client->busy() && !client->has_turn && !client->connection; });
}

void Server::State::end_all() {
    for (const auto& client : clients)
        if (client->connection && !client->turn.closes) client->connection->cancel();
    pool.end();
    for (const auto& client : clients) {
        if (client->has_turn) client->out += client->turn.replies;
        if (client->busy()) {
            client->worker.join();
            client->out += client->result;
        }
        if (!client->gone) send_out(*client);
    }
    endpoint.stop_listening();
    clients.clear();
    if (spare >= 0) close(std::exchange(spare, -1));
    connected = 0;
}

/// When the next subscription of the client is due; never while it has a turn, at whose end they are sent.
std::int64_t Server::State::next_due_ns(Client& client) {
    return client.gone || client.has_turn ? std::numeric_limits<std::int64_t>::max() : client.connection->next_due_ns();
}

/// True when the client's next request can be executed now.
bool Server::State::has_work(Client& client) {
    if (client.gone || client.busy() || client.has_turn || client.halting_since != 0 || client.waiting() > options.queue) return false;
    return client.line_end() != std::string::npos && (client.placed || !client.not_urgent);
}

/// Time until the next subscription or client timeout is due; 0 while complete requests are pending.
int Server::State::sleep_ms() {
    const std::int64_t now = monotonic_ns();
    std::int64_t until = accepts_from > now ? accepts_from : std::numeric_limits<std::int64_t>::max();
    for (const auto& client : clients) {
        if (client->gone) continue;
        if (has_work(*client)) return 0;
        until = std::min(until, next_due_ns(*client));
        if (client->halting_since != 0) until = std::min(until, now + halt_poll_ns);
        if (!client->placed) until = std::min(until, client->came_ns + give_up_ns);
        if (client->stalled_since != 0) until = std::min(until, client->stalled_since + std::int64_t{options.stall_ms} * 1'000'000);
    }
    if (files_short || count(true) > options.max_clients) until = std::min(until, now + std::int64_t{options.idle_ms} * 250'000);
    if (until == std::numeric_limits<std::int64_t>::max()) return -1;
    return until <= now ? 0 : static_cast<int>(std::min<std::int64_t>((until - now + 999'999) / 1'000'000, 60'000));
}

/// Opens the descriptor in reserve again, once no client uses it.
void Server::State::keep_spare() {
    if (spare < 0) spare = eventfd(0, EFD_CLOEXEC);
    if (spare >= 0) files_short = false;
}

/// Accepts a connection; with the descriptor in reserve when the process has no other. Returns -1 when there is none, or no way to accept it.
int Server::State::accept_one() {
    int fd = accept4(endpoint.fd(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
    if (fd >= 0) return fd;
    if (errno != EMFILE && errno != ENFILE && errno != ENOBUFS && errno != ENOMEM) return -1;
    files_short = true;
    if (!close_one_idle(urgent_ns) && spare >= 0) close(std::exchange(spare, -1));
    fd = accept4(endpoint.fd(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
    if (fd < 0) accepts_from = monotonic_ns() + no_files_ns;
    return fd;
}

/// Closes the client that has been idle longest, for at least this time. False when there is none.
bool Server::State::close_one_idle(std::int64_t idle_ns) {
    const std::int64_t now = monotonic_ns();
    Client* longest = nullptr;
    for (const auto& client : clients) {
        const bool occupied = client->gone || client->has_turn || client->busy() || client->halting_since != 0 || now - client->active_ns < idle_ns;
        if (occupied || (longest && longest->active_ns <= client->active_ns)) continue;
        if (!client->placed || client->connection->idle()) longest = client.get();
    }
    if (!longest) return false;
    close_idle(*longest);
    return true;
}

/// Closes the client without a place that has been connected longest, if it had the time for an urgent request. False when there is none.
bool Server::State::make_way() {
    Client* oldest = nullptr;
    for (const auto& client : clients)
        if (!client->gone && !client->placed && client->halting_since == 0 && (!oldest || client->came_ns < oldest->came_ns)) oldest = client.get();
    if (!oldest || monotonic_ns() - oldest->came_ns < urgent_ns) return false;
    ++reclaimed;
    close_client(*oldest, files_short ? "the machine has no file descriptor left" : "too many clients are connected");
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
    if (getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0 || (peer.uid != geteuid() && peer.uid != 0)) {
        ++refused;
        log("rejected a client of user " + std::to_string(peer.uid));
        close(fd);
        return;
    }
    ++accepted;
    clients.push_back(std::make_unique<Client>(fd, shell, peer.pid));
    Client& client = *clients.back();
    client.placed = spare >= 0 && count(true) < places();
    client.reserved = client.placed && count(true) > options.max_clients;
    client.connection->on_event([this, &client](std::string line) {
        const std::scoped_lock lock(client.events_mutex);
        client.events += line;
        eventfd_write(wake, 1);
    });
    client.out = client.connection->hello();
    send_out(client);
}

/// Gives free places to those who wait for one, in the order in which they came, and closes the connection of those who have waited too long.
void Server::State::place_clients() {
    const std::int64_t now = monotonic_ns();
    for (const auto& client : clients) {
        if (client->gone || client->placed) continue;
        if (spare >= 0 && count(true) < places()) {
            client->placed = true;
            client->reserved = count(true) > options.max_clients;
        } else if (now - client->came_ns >= give_up_ns) {
            ++refused;
            close_client(*client, spare < 0 ? "the machine has no file descriptor left" : "too many clients are connected, and none of them is idle");
        }
    }
}

/// While more clients are connected than there are places, those go that have been idle longest, and one in a reserved place that
/// keeps it from the next. When the process has no descriptor left, an idle client goes, too.
void Server::State::reclaim() {
    std::size_t living = count(true);
    const std::int64_t now = monotonic_ns(), idle_ns = std::int64_t{options.idle_ms} * 1'000'000;
    if (files_short && spare < 0) close_one_idle(idle_ns);
    if (living <= options.max_clients) {
        for (const auto& client : clients) client->reserved = false;
        return;
    }
    for (; living > options.max_clients; --living) {
        Client* longest = nullptr;
        for (const auto& client : clients) {
            if (client->gone || !client->placed || client->has_turn || now - client->active_ns < idle_ns) continue;
            if (longest && longest->active_ns <= client->active_ns) continue;
            const bool in_the_way = client->reserved && living == places();
            const bool goes =
                client->busy() ? in_the_way && now - client->active_ns >= 10 * idle_ns : in_the_way || client->connection->idle();
            if (goes) longest = client.get();
        }
        if (!longest) return;
        close_idle(*longest);
    }
}

void Server::State::close_idle(Client& client) {
    ++reclaimed;
    const std::string idle = std::to_string((monotonic_ns() - client.active_ns) / 1'000'000'000) + " s";
    const std::string why = count(true) > options.max_clients ? "more than " + std::to_string(options.max_clients) + " clients are connected"
                                                              : "the machine has no file descriptor left";
    close_client(client, why + ", and this one sent no request for " + idle);
    log("disconnected a client without a request for " + idle + ": " + why);
}

void Server::State::close_client(Client& client, const std::string& reason) {
    client.out += "{\"event\":\"closed\",\"reason\":\"" + reason + "\"}\n";
    send_out(client);
    if (client.gone) return;
    shutdown(client.fd, SHUT_RDWR);
    leave(client);
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
    client.connection->cancel();
    close(std::exchange(client.fd, -1));
}

void Server::State::execute(Client& client) {
    while (has_work(client) && execute_urgent(client)) {
    }
    if (client.gone || client.has_turn) return;
    if (client.halting_since != 0 && !execute_urgent(client)) return;
    if ((client.placed && has_work(client)) || next_due_ns(client) <= monotonic_ns()) give_turn(client);
}

/// Executes the client's next request if it must not wait. False when it is not such a request, or not done yet.
bool Server::State::execute_urgent(Client& client) {
    const std::size_t end = client.line_end();
    const std::string_view line = client.line(end);
    if (line.empty()) {
        client.done_up_to(end + 1);
        return true;
    }
    if (client.not_urgent) return false;
    const std::uint64_t before = client.connection->requests();
    const std::int64_t now = monotonic_ns();
    auto done = client.halting_since != 0 ? client.connection->halted(line, client.out) : client.connection->execute_urgent(line, client.out);
    if (done == Connection::Urgent::halting) {
        if (client.halting_since == 0) client.halting_since = now;
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
        send_out(client);
        options.stop();
    }
    return true;
}

/// Hands the client's complete requests over to the executors.
void Server::State::give_turn(Client& client) {
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
    client.has_turn = true;
    client.turn_over = false;
    pool.give(client);
}

void Server::State::collect_turn(Client& client) {
    if (!client.has_turn || !client.turn_over.load(std::memory_order_acquire)) return;
    client.has_turn = false;
    Turn& turn = client.turn;
    if (turn.closes) return;
    if (turn.requests + turn.rubbish > 0) client.active_ns = monotonic_ns();
    requests += turn.requests;
    rubbish += turn.rubbish;
    if (!client.busy()) {
        const std::scoped_lock lock(client.events_mutex);
        client.out += std::exchange(client.events, {});
    }
    client.out += turn.replies;
    turn.replies = {};
    if (!turn.lines.empty()) {
        client.in.replace(0, client.taken, turn.lines);
        client.taken = client.searched = 0;
        turn.lines = {};
    }
    if (turn.stop && options.stop) {
        if (!client.gone) send_out(client);
        options.stop();
    }
    if (turn.waiting.empty()) return;
    start_worker(client, std::exchange(turn.waiting, {}));
    if (client.gone) client.connection->cancel();  // what it waits for is not waited for
}

void Server::State::start_worker(Client& client, std::string request) {
    client.active_ns = monotonic_ns();
    client.connection->cancel(false);
    client.finished = false;
    client.worker = std::thread([this, &client, line = std::move(request)] {
        client.connection->handle(line, client.result, true);
        ++requests;
        client.finished.store(true, std::memory_order_release);
        eventfd_write(wake, 1);
    });
}

void Server::State::look_for_cancel(Client& client) {
    for (std::size_t at = client.taken; at < client.in.size();) {
        const auto end = client.in.find('\n', at);
        if (end == std::string::npos || client.connection->cancels(std::string_view(client.in).substr(at, end - at))) return;
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
    if (!client.gone) client.connection->cancel(false);
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
