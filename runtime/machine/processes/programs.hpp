// SPDX-License-Identifier: MIT
// Components that are processes of their own: programs started by loadusr, and those that
// registered themselves over the socket.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <sys/types.h>

#include "machine/processes/child_processes.hpp"
#include "machine/processes/program_entry.hpp"
#include "machine/processes/program_model.hpp"
#include "machine/processes/stream_users.hpp"
#include "netlist/netlist.hpp"

namespace hal {

class RunningModel;
class Transaction;
struct SessionState;

/// The programs of a session. All members need the session's lock; those that take a lock release
/// it while they wait. [setup]
class Programs final : private ChildEvents {
public:
    using Entry = ProgramEntry;

    Programs(RunningModel& machine, SessionState& state);
    ~Programs();  ///< terminates all children: SIGTERM, then after two seconds SIGKILL

    /// Components and pins of programs.
    ProgramModel& model() { return model_; }

    /// Prints no line when a component dies: the caller watches them and reports more.
    void leave_deaths_to_caller() { prints_deaths_ = false; }

    /// Starts a program. Returns its process ID, or 0 with the reason in `problem`. `waited`: the
    /// caller reads its status, then calls collect().
    pid_t start(const ProcessStart& start, bool waited, std::string& problem);
    /// Makes a started program a component of the session. Returns the number of its entry. The
    /// name is made unique if it is in use; when it is `reserved`, which must be free or a dead
    /// program's, it is this process's alone.
    std::uint64_t add(pid_t pid, const std::string& name, const Command& command,
                      bool reserved = false);
    /// Applies a restart policy to a started program.
    void keep_alive(pid_t pid, const ProcessStart& start, const RestartPolicy& policy);
    /// Registers a program as the component `name`; it takes over the pins of a dead one of that
    /// name. Returns an empty string, or the reason of a rejection. `owner` is the connection that
    /// registers it; `ready` false: it adds pins first.
    std::string announce(pid_t pid, const std::string& name, std::uint64_t owner = 0,
                         bool ready = true);
    /// Returns the component of that name if this connection answers for it, or nullptr.
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
    /// A component leaves in good order: its pins are removed. One that took over those of a dead
    /// program and is not ready yet is dead.
    void leave(Entry& entry);
    /// A connection has ended; what it answered for and did not leave() is dead.
    void withdraw(std::uint64_t owner);
    /// Returns true when a component depends on this connection.
    bool answers(std::uint64_t owner) const;
    /// Returns the next connection's number.
    std::uint64_t new_owner() { return ++owners_; }
    StreamUsers& stream_users() { return stream_users_; }
    ProgramStream* find_stream(std::string_view name);
    std::vector<std::string> stream_names() const;
    Entry* find(std::string_view name);
    Entry* find(pid_t pid);
    Entry* find_number(std::uint64_t number);
    /// Returns the last program that loadusr has started under this name, if it runs or is started
    /// again, whatever name it has registered.
    Entry* find_started_as(std::string_view name);
    /// Returns true when one of the last programs had this name.
    bool was_known(std::string_view name) const;
    /// Returns the names of the components that the process has registered.
    std::vector<std::string> registered_by(pid_t pid) const;
    /// Returns why the last registration of a child was rejected, also of one that has ended since;
    /// "" when none was.
    std::string refusal_of(pid_t pid) const;
    /// Returns the status of a child that has ended lately: exit status, or 128 + signal.
    std::optional<int> ended_with(pid_t pid) const;
    std::vector<std::string> names() const;
    bool idle() const { return entries_.empty(); }  ///< no program is known
    /// Returns true while the process is a child whose exit status is still to come.
    bool runs_as_child(pid_t pid) const;
    /// Removes the entry of a waited child.
    void collect(pid_t pid);
    /// Nobody waits for it any more.
    void abandon(pid_t pid);
    bool terminate(Entry& entry);  ///< SIGTERM, and no restart; a dead one is forgotten
    /// `unload` and `unloadusr` in a transaction: the component of a dead program leaves the model
    /// with it; a living one is terminated when it has taken effect. Returns an empty string, or
    /// why it cannot be.
    std::string unload(Transaction& transaction, Entry& entry);
    /// Ends a program whose start has failed: its name is free at once, and SIGKILL follows SIGTERM
    /// after 5 s.
    void give_up(Entry& entry);

    /// A command waits for the end of a process, from here to its own end. [setup]
    class Awaited {
    public:
        Awaited(Programs& programs, pid_t pid) : programs_(programs), pid_(pid) {
            programs_.awaited_.push_back(pid_);
        }
        ~Awaited() { std::erase(programs_.awaited_, pid_); }
        Awaited(const Awaited&) = delete;

    private:
        Programs& programs_;
        const pid_t pid_;
    };
    /// Returns true when a command waits for the end of this process, or of one that has started
    /// it.
    bool awaits(pid_t pid) const;

    /// Releases the lock until something about a process changes, for `timeout` at most.
    void wait(std::unique_lock<std::mutex>& lock, std::chrono::milliseconds timeout) {
        changed_.wait_for(lock, timeout);
    }

private:
    std::int64_t next_due_ns() const override;
    void child_ended(pid_t pid, int status) override;
    void act_in_time(std::int64_t overslept_ns) override;
    void notify() override { changed_.notify_all(); }

    bool any_child_runs() const;
    void signal_children(int signal);
    std::string reject(pid_t pid, std::string why);
    std::string conflict_with(const Entry& entry, pid_t pid) const;
    Entry* find_newcomer(const Entry& dead, pid_t pid);
    Entry& succeed(Entry& dead, pid_t pid);
    Entry& enter(Entry* of_process, pid_t pid, const std::string& name);
    void end_component(Entry& entry, int status);
    void end_child(std::size_t index, int status);
    void schedule(Entry& entry);
    void time_out(Entry& entry);
    void apply_declared_values(Entry& entry);
    void start_again(Entry& entry, std::int64_t now_ns);
    pid_t spawn(const ProcessStart& start, std::string& problem);
    bool has_pins(const Entry& entry) const;
    bool has_outputs(const Entry& entry) const;
    void report_death(const Entry& entry, const std::string& how);
    void remove(const Entry& entry);
    void forget(Entry& entry);
    void note_name(const std::string& name);

    RunningModel& machine_;
    ProgramModel model_;
    StreamUsers stream_users_;
    std::vector<Entry> entries_;
    std::condition_variable changed_;
    std::vector<pid_t> awaited_;
    std::uint64_t owners_ = 0;
    std::uint64_t numbers_ = 0;
    std::deque<std::pair<pid_t, std::string>> refusals_;  // the newest first
    static constexpr std::size_t max_refusals = 16;
    std::deque<std::pair<pid_t, int>> last_ends_;  // of children, with status; the newest first
    static constexpr std::size_t max_last_ends = 64;
    std::deque<std::string> known_names_;  // the newest first
    static constexpr std::size_t max_known_names = 256;
    bool ending_children_ = false;  // nothing is started again
    bool prints_deaths_ = true;
    ChildProcesses children_;
};

}  // namespace hal
