// SPDX-License-Identifier: MIT
// What belongs to the computer and not to one process: the lock file of LinuxCNC, System V
// segments, processes that others have left behind.
#pragma once

#include <string>
#include <sys/types.h>
#include <vector>

#include "linuxcnc/configuration.hpp"

namespace hal::tools {

/// A variable in the environment of all programs of a machine: the process ID of its launcher.
inline constexpr const char* launcher_variable = "HALCYON_LAUNCHER";

/// LinuxCNC's lock file, linuxcnc.lock in the temporary folder: NML allows one machine per
/// computer. Removed with the object.
class MachineLock {
public:
    MachineLock();
    ~MachineLock();
    MachineLock(const MachineLock&) = delete;
    /// Returns why there is no lock; empty: this process has it.
    const std::string& problem() const { return problem_; }
    /// True when the machine before was killed, and its programs had to be ended.
    bool took_over() const { return took_over_; }
    /// Notes the NML server, which outlives a launcher that is killed: the next one ends it.
    void note_server(pid_t pid);

private:
    void take_over(const std::string& noted);
    std::string path_, problem_;
    int file_ = -1;
    bool took_over_ = false;
};

/// Removes the shared memory of motion and the NML buffers, with their semaphores, that no process
/// of this user has open any more.
void remove_segments(const Configuration&);

struct Child {
    pid_t pid = 0;
    std::string name;  ///< at most 15 characters
    bool ended = false;
};

/// Returns the state of a process as /proc prints it: 'R', 'S', 'T' when a signal has stopped it,
/// 'Z'; 0 when there is none.
char state_of(pid_t pid);
/// Has processes whose parent ends become children of this one, so that it can end them.
void adopt_orphans();
/// Returns the children of this process.
std::vector<Child> children();
/// Reaps a child that has ended; true when it had.
bool reap(pid_t pid);

}  // namespace hal::tools
