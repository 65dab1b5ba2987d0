// SPDX-License-Identifier: MIT
// Components that are processes of their own: programs started by loadusr, and those that
// registered themselves over the socket.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <sys/types.h>

#include "hal/abi.h"
#include "machine/spawner.hpp"
#include "netlist/netlist.hpp"

namespace hal {

class Session;
class Transaction;
struct Pin;
struct SessionState;

enum class Restart { no, on_failure, always };

/// Whether a program that has ended is started again, modelled on systemd's Restart=, RestartSec=
/// and StartLimit….
struct RestartPolicy {
    Restart when = Restart::no;
    std::int64_t delay_ns = 1'000'000'000;
    static constexpr std::size_t most = 5;                       ///< restarts within …
    /// … this time; after that it is not started again
    static constexpr std::int64_t within_ns = 10'000'000'000;
};

struct ProcessStart {
    std::vector<std::string> arguments;  ///< the program first; looked up in PATH
    std::string directory;               ///< to run in; empty: this process's
    /// file descriptors for its stdout and stderr; -1: this process's
    int out = -1;
    int err = -1;
    bool keep_stdin = false;             ///< false: it reads /dev/null
};

/// A pin or parameter of a program's component.
struct ProgramPin {
    std::string name;                ///< full name
    hal_type type = HAL_TYPE_BIT;
    hal_dir dir = HAL_DIR_IN;
    bool read_only = false;          ///< a parameter that only the program sets
    hal_value initial{};
    /// its value once the program is dead; none: it keeps its value
    std::optional<hal_value> safe = {};
    std::string doc = {};
    std::string unit = {};
};

/// A stream between programs: one feeds it, one reads it.
struct ProgramStream {
    std::string name, types;
    std::vector<hal_value> memory;
    hal_stream stream{};
};

/// The programs of a session. All members need the session's lock; those that take a lock release
/// it while they wait. [setup]
struct Programs {
    struct Entry {
        std::uint64_t number = 0;  ///< of this entry, for as long as it lives
        std::string name = {};  ///< as component; empty: not registered as one
        pid_t pid = 0;
        bool child = false;     ///< started by loadusr, so that its end is seen here
        bool ready = false;     ///< registered as a component over the socket
        /// a `loadusr -w` waits for its status: kept after its end, until collect()
        bool waited = false;
        bool ended = false;
        int status = 0;         ///< exit status, or 128 + signal
        /// until it is ready, the name is that of this process, whatever else the process registers
        bool reserved = false;
        bool again = false;  ///< dead, and a successor has been started
        std::uint64_t owner = 0;  ///< the connection that answers for the component; 0: none
        std::vector<Pin*> pins = {};  ///< of the living program, by its numbers
        static constexpr std::int64_t usual_timeout_ns = 1'000'000'000;
        /// from its death until its pins take their declared values; < 0: never
        std::int64_t timeout_ns = usual_timeout_ns;
        std::int64_t dead_ns = 0;  ///< since when it is dead, on the steady clock; 0: it lives
        std::string end_report = {};  ///< "since 12:34:56 (exit status 1)"
        bool declared = false;  ///< dead, and its pins have taken their declared values
        bool stopping = false;  ///< asked to end: not started again
        RestartPolicy restart = {};
        ProcessStart start = {};  ///< how to start it again
        std::vector<std::int64_t> restarts = {};  ///< when it was, lately
        std::int64_t restart_ns = 0;  ///< when it is to be started again; 0: not
        std::int64_t kill_ns = 0;  ///< when it gets SIGKILL; 0: never

        /// the longest time between two exchanges that it has declared; 0: none
        std::int64_t every_ns = 0;
        /// when it last gave a sign of life; kept while every_ns is not 0
        std::int64_t alive_ns = 0;
        std::string unresponsive = {};  ///< "since 12:34:56" while it does not respond
        /// what its pins had when they took their declared values
        std::vector<std::pair<Pin*, hal_value>> before_timeout = {};

        std::vector<std::shared_ptr<ProgramStream>> streams = {};  ///< it made; they go with it

        bool dead() const { return dead_ns != 0; }
        bool responds() const { return ready && unresponsive.empty(); }
        /// When it is no longer waited for; meaningful while every_ns is not 0.
        std::int64_t due_ns() const {
            return alive_ns + every_ns + (timeout_ns >= 0 ? timeout_ns : usual_timeout_ns);
        }
        /// As `show comp` prints it.
        std::string state() const;
    };

    Programs(Session& session, SessionState& state);
    ~Programs();  ///< terminates all children: SIGTERM, then after two seconds SIGKILL

    /// Starts a program. Returns its process ID, or 0 with the reason in `problem`. `waited`: the
    /// caller reads its status, then calls collect().
    pid_t start(const ProcessStart& start, bool waited, std::string& problem);
    /// Makes a started program a component of the session. Its entry's number. The name is made
    /// unique if it is taken; when it is
    /// `reserved`, which must be free or a dead program's, it is this process's alone.
    std::uint64_t add(pid_t pid, const std::string& name, const Command& command,
                      bool reserved = false);
    /// Adds a component for the process `pid` to the model.
    void add_component(Transaction& transaction, const std::string& name, std::int64_t pid,
                       const Command& command);
    /// Adds a pin to a program's component. It is linked like any other, and no thread runs it.
    /// Returns nullptr and sets `problem` to the reason.
    Pin* add_pin(Transaction& transaction, std::string_view component, const ProgramPin& pin,
                 std::string& problem);
    /// Unlinks and removes pins of a program's component.
    void remove_pins(Transaction& transaction, std::string_view component,
                     const std::vector<Pin*>& pins);
    /// Applies a restart policy to a started program.
    void keep_alive(pid_t pid, const ProcessStart& start, const RestartPolicy& policy);
    /// Registers a program as the component `name`; it takes over the pins of a dead one of that
    /// name. Returns an empty string, or the reason of a rejection. `owner` is the connection that
    /// registers it; `ready` false: it adds pins first.
    std::string announce(pid_t pid, const std::string& name, std::uint64_t owner = 0,
                         bool ready = true);
    /// The component of that name if this connection answers for it, or nullptr.
    Entry* owned(std::string_view name, std::uint64_t owner);
    void set_ready(Entry& entry, bool ready);
    /// A component is lost: its pins keep their values, later take the declared ones, and wait for
    /// a successor.
    void die(Entry& entry, const std::string& how);
    /// Records a sign of life of a component that has declared a rate; one that did not respond
    /// gets its values back.
    void note_alive(Entry& entry);
    /// A component declares that it exchanges values at least so often; 0: no longer.
    void set_rate(Entry& entry, std::int64_t every_ns);
    /// A component leaves in good order: its pins go.
    void leave(Entry& entry);
    /// A connection has ended; what it answered for and did not leave() is dead.
    void withdraw(std::uint64_t owner);
    /// Whether a component depends on this connection.
    bool answers(std::uint64_t owner) const;
    /// The next connection's number.
    std::uint64_t new_owner() { return ++owners_; }
    ProgramStream* find_stream(std::string_view name);
    std::vector<std::string> stream_names() const;
    Entry* find(std::string_view name);
    Entry* find(pid_t pid);
    Entry* find_number(std::uint64_t number);
    /// The components that the process has registered.
    std::vector<std::string> registered_by(pid_t pid) const;
    /// Why the last registration of a child was rejected, also of one that has ended since; "" when
    /// none was.
    std::string refusal_of(pid_t pid) const;
    std::vector<std::string> names() const;
    bool idle() const { return entries_.empty(); }  ///< no program is known
    /// Takes the entry of a waited child out of the list.
    void collect(pid_t pid);
    /// Nobody waits for it any more.
    void abandon(pid_t pid);
    bool terminate(Entry& entry);  ///< SIGTERM, and no restart; a dead one is forgotten
    /// `unload` and `unloadusr` in a transaction: the component of a dead program leaves the model with it; a living one is
    /// terminated when it has taken effect. Empty, or why it cannot be.
    std::string unload(Transaction& transaction, Entry& entry);
    /// Ends a program whose start has failed: its name is free at once, and SIGKILL follows SIGTERM
    /// after 5 s.
    void give_up(Entry& entry);

    /// Releases the lock until something about a process changes, for `most` at most.
    void wait(std::unique_lock<std::mutex>& lock, std::chrono::milliseconds most) {
        changed_.wait_for(lock, most);
    }

private:
    void work();  // starts the thread below
    void reap();
    void child_ended(pid_t pid, int status);
    void schedule(Entry& entry);
    void act_in_time(std::int64_t overslept_ns);
    void time_out(Entry& entry);
    std::string name_in_use(const Entry& entry) const;
    int sleep_ms() const;
    pid_t spawn(const ProcessStart& start, std::string& problem);
    bool has_pins(const Entry& entry) const;
    void forget(Entry& entry);
    void add_to_model(const std::string& name, pid_t pid, const Command& command);
    void replace_in_model(std::string_view name, pid_t pid);
    void remove_from_model(std::string_view name);

    void remove_component(Transaction& transaction, std::string_view name);

    Session& session_;
    SessionState& state_;
    std::vector<Entry> entries_;
    std::condition_variable changed_;
    std::uint64_t owners_ = 0;
    std::uint64_t numbers_ = 0;
    std::unique_ptr<Spawner> spawner_;
    std::deque<std::pair<pid_t, std::string>> refusals_;  // the newest first
    static constexpr std::size_t most_refusals = 16;
    std::thread reaper_;  // sleeps in poll() on the children's pidfds, and until something is due
    // eventfd: the list of children has changed, something is due, or the reaper is to end
    int wake_ = -1;
    bool ending_ = false;
    bool ending_children_ = false;  // nothing is started again
    struct Watched {
        pid_t pid;
        int pidfd;
    };
    std::vector<Watched> watched_;
};

/// Returns the local time of day `ago_ns` ago: "12:34:56".
std::string time_of_day(std::int64_t ago_ns = 0);

}  // namespace hal
