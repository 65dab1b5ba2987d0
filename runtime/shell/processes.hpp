// SPDX-License-Identifier: MIT
// Programs outside the runtime: those started by loadusr, and those that registered themselves over the socket.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <sys/types.h>

#include "netlist/netlist.hpp"

namespace hal {

class Session;

struct ProcessStart {
    std::vector<std::string> arguments;  ///< the program first; looked up in PATH
    std::string directory;               ///< to run in; empty: this process's
    int out = -1, err = -1;              ///< file descriptors for its stdout and stderr; -1: this process's
    bool keep_stdin = false;             ///< false: it reads /dev/null
};

/// All members need Session::mutex held, and those that take a lock give it back while they wait.
struct Processes {
    struct Entry {
        std::string name = {};  ///< as component; empty: not registered as one
        pid_t pid = 0;
        bool child = false;     ///< started by loadusr, so that its end is seen here
        bool ready = false;     ///< has said over the socket that it is a component
        bool waited = false;    ///< a `loadusr -w` waits for its status: kept after its end, until collect()
        bool ended = false;
        int status = 0;         ///< exit status, or 128 + signal
    };

    explicit Processes(Session& session);
    ~Processes();  ///< terminates all children: SIGTERM, then after two seconds SIGKILL

    /// Starts a program. 0: `problem` says why not. `waited`: somebody will ask for its status and then collect() it.
    pid_t start(const ProcessStart& start, bool waited, std::string& problem);
    /// Makes a started program a component of the session. Its name, made unique if it is taken.
    std::string add(pid_t pid, const std::string& name, const Command& command);
    /// A program says that it is the component `name` and is ready. Empty, or why not.
    std::string announce(pid_t pid, const std::string& name);
    /// A program that announced itself is gone (its connection ended).
    void withdraw(const std::string& name);
    Entry* find(std::string_view name);
    Entry* find(pid_t pid);
    std::vector<std::string> names() const;
    bool idle() const { return entries_.empty(); }  ///< no program is known
    /// Takes the entry of a waited child out of the list.
    void collect(pid_t pid);
    /// Nobody waits for it any more.
    void abandon(pid_t pid);
    bool terminate(Entry& entry);  ///< SIGTERM

    /// Sleeps until something about a process changes, at most so long.
    void wait(std::unique_lock<std::mutex>& lock, std::chrono::milliseconds most) { changed_.wait_for(lock, most); }

private:
    void reap();
    void forget(Entry& entry);

    Session& session_;
    std::vector<Entry> entries_;
    std::condition_variable changed_;
    std::thread reaper_;   // sleeps in poll() on the children's pidfds
    int wake_ = -1;        // eventfd: the list of children has changed, or the reaper is to end
    bool ending_ = false;
    struct Watched {
        pid_t pid;
        int pidfd;
    };
    std::vector<Watched> watched_;
};

}  // namespace hal
