// SPDX-License-Identifier: MIT
// What the server's thread holds. Internal to the server.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <sys/eventfd.h>

#include "commands/shell.hpp"
#include "control/endpoint.hpp"
#include "control/executors.hpp"
#include "control/server.hpp"
#include "machine/session.hpp"

namespace hal {

// a client without a place waits for one at most
constexpr std::int64_t give_up_ns = 5'000'000'000;

// Two kinds of threads: the server's own accepts, reads and writes, and executes what must not wait
// (`stop`, `options`); executors do all the rest. The server's thread takes no lock of the session,
// so whatever clients do, the next `stop` is seen at once. For that a client gets in when all
// places are taken, and with the descriptor that is kept in reserve when the process has no other.
struct Server::State {
    State(Shell& s, ServerOptions o) : shell(s), options(std::move(o)) {}

    Shell& shell;
    ServerOptions options;
    Endpoint endpoint;
    /// eventfd: a worker or an executor has finished, or the server is to end
    int wake = -1;
    int spare = -1;  ///< a descriptor in reserve
    std::atomic<bool> ending{false};
    std::thread thread;
    std::int64_t accepts_from = 0;  ///< on the steady clock
    /// accept has failed because the process has no descriptor left
    bool files_short = false;
    std::vector<std::unique_ptr<ServedClient>> clients;
    Executors pool{[this] { eventfd_write(wake, 1); },
                   [this] { return ending || shell.session().ending(); }};
    std::atomic<std::uint64_t> connected{0};
    std::atomic<std::uint64_t> accepted{0};
    std::atomic<std::uint64_t> dropped{0};
    std::atomic<std::uint64_t> reclaimed{0};
    std::atomic<std::uint64_t> refused{0};

    std::atomic<std::uint64_t> requests{0};
    std::atomic<std::uint64_t> rubbish{0};

    void serve();
    void serve_client(ServedClient& client, short events);
    void watch_process(ServedClient& client);
    bool give_up_watch();
    void note_process_end(ServedClient& client);
    void end_all();
    bool clients_wait_for_end() const;
    int sleep_ms();
    bool has_work(ServedClient& client);
    std::int64_t next_due_ns(ServedClient& client);
    void accept_clients();
    void add_client(int fd);
    int accept_one();
    bool close_one_idle(std::int64_t idle_ns);
    void keep_spare();
    bool make_way();
    void receive(ServedClient& client, bool hung_up);
    void execute(ServedClient& client);
    bool execute_urgent(ServedClient& client);
    void give_turn(ServedClient& client);
    void collect_turn(ServedClient& client);
    void start_worker(ServedClient& client, std::string request);
    void look_for_cancel(ServedClient& client);
    void collect_worker(ServedClient& client);
    void place_clients();
    void reclaim();
    void close_idle(ServedClient& client);
    void close_client(ServedClient& client, const std::string& reason);
    void send_out(ServedClient& client);
    void leave(ServedClient& client);
    void remove_gone();
    std::size_t places() const { return options.max_clients + options.reserved; }
    std::size_t count(bool placed) const {
        return static_cast<std::size_t>(std::count_if(
            clients.begin(), clients.end(),
            [&](const auto& client) { return !client->gone && client->placed == placed; }));
    }
    bool listens_to(const ServedClient& client) const {
        return !client.input_ended && !client.told_end && client.waiting() <= options.queue &&
               client.in.size() - client.taken <= options.max_request;
    }
    void log(const std::string& sentence) const {
        if (options.log) {
            options.log(sentence);
        }
    }
};

}  // namespace hal
