// SPDX-License-Identifier: MIT
#include "linuxcnc/leftovers.hpp"

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <fmt/core.h>
#include <fstream>
#include <sstream>
#include <sys/file.h>
#include <sys/ipc.h>
#include <sys/prctl.h>
#include <sys/sem.h>
#include <sys/shm.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "cli/output.hpp"
#include "linuxcnc/nml_buffers.hpp"
#include "text/folder_entries.hpp"
#include "text/numbers.hpp"

namespace hal::tools {

namespace {

namespace fs = std::filesystem;

/// Name, state and parent of a process, from /proc; pid 0: it has ended.
struct Process {
    pid_t pid = 0;
    pid_t parent = 0;
    std::string name;
    char state = 0;
};

std::vector<Process> processes() {
    std::vector<Process> all;
    for (const fs::path& path : folder_entries("/proc")) {
        const auto number = parse_natural(path.filename().string());
        if (!number) continue;
        // not a stream: reading of a process that has just ended fails, which a stream throws
        char content[1024];
        const int file = ::open((path / "stat").c_str(), O_RDONLY | O_CLOEXEC);
        const ssize_t length = file < 0 ? 0 : ::read(file, content, sizeof content);
        if (file >= 0) {
            ::close(file);
        }
        const std::string_view text(content, length > 0 ? static_cast<std::size_t>(length) : 0);
        // a name may have blanks and brackets
        const auto begin = text.find('(');
        const auto end = text.rfind(')');
        if (end == text.npos || end + 2 >= text.size()) continue;
        Process process{static_cast<pid_t>(*number), 0,
                        std::string(text.substr(begin + 1, end - begin - 1)), text[end + 2]};
        std::istringstream(std::string(text.substr(end + 3))) >> process.parent;
        all.push_back(std::move(process));
    }
    return all;
}

/// LinuxCNC's launcher writes nothing into its lock file: whether it runs, its processes show.
std::string running_of_linuxcnc() {
    for (const Process& process : processes()) {
        if (process.name == "linuxcncsvr" || process.name == "milltask" ||
            process.name == "rtapi_app") {
            if (process.state != 'Z') {
                return fmt::format("{}, process {}", process.name, process.pid);
            }
        }
    }
    return {};
}

constexpr const char* one_machine =
    "another LinuxCNC machine is running ({}), and NML allows one per computer; end it first";

/// $TMPDIR, or /tmp. Need not exist: opening the lock file then fails.
std::string temporary_folder() {
    const char* const named = std::getenv("TMPDIR");
    return named && *named ? named : "/tmp";
}

/// Removes the System V segment of this user with that key. Returns false while it is used.
bool remove_segment(key_t key) {
    const int id = ::shmget(key, 0, 0);
    if (id < 0) return true;
    shmid_ds segment{};
    const bool is_known = ::shmctl(id, IPC_STAT, &segment) == 0;
    if (segment.shm_nattch != 0) return false;
    if (is_known && segment.shm_perm.uid == ::geteuid()) {
        ::shmctl(id, IPC_RMID, nullptr);
    }
    return true;
}

void remove_semaphores(key_t key) {
    const int set = ::semget(key, 0, 0);
    semid_ds semaphores{};
    if (set >= 0 && ::semctl(set, 0, IPC_STAT, &semaphores) == 0 &&
        semaphores.sem_perm.uid == ::geteuid()) {
        ::semctl(set, 0, IPC_RMID);
    }
}

}  // namespace

MachineLock::MachineLock() : path_(temporary_folder() + "/linuxcnc.lock") {
    constexpr int how = O_RDWR | O_CLOEXEC | O_NOFOLLOW;
    file_ = ::open(path_.c_str(), how | O_CREAT | O_EXCL, 0644);
    const bool was_there = file_ < 0 && errno == EEXIST;
    if (was_there) {
        file_ = ::open(path_.c_str(), how);
    }
    if (file_ < 0) {
        problem_ = fmt::format("cannot open the lock file {}: {}; {}", path_, std::strerror(errno),
                               errno == ENOENT ? "create its folder, which $TMPDIR names"
                                               : "if no LinuxCNC is running, remove it");
        return;
    }
    char noted[64] = {};
    const bool free = ::flock(file_, LOCK_EX | LOCK_NB) == 0;
    const ssize_t length = ::pread(file_, noted, sizeof noted - 1, 0);
    if (!free) {
        problem_ = fmt::format(one_machine, fmt::format("process {}", std::atoi(noted)));
    } else if (was_there && length > 0) {
        take_over(noted);
    } else if (const std::string other = was_there ? running_of_linuxcnc() : ""; !other.empty()) {
        problem_ = fmt::format(one_machine, other);
    }
    if (problem_.empty()) {
        note_server(0);
    }
    if (problem_.empty()) return;
    ::close(file_);
    file_ = -1;
}

void MachineLock::note_server(pid_t pid) {
    const std::string text =
        pid != 0 ? fmt::format("{}\n{}\n", ::getpid(), pid) : fmt::format("{}\n", ::getpid());
    if (::ftruncate(file_, 0) == 0 && ::pwrite(file_, text.data(), text.size(), 0) < 0 &&
        pid == 0) {
        problem_ = std::strerror(errno);
    }
}

namespace {

bool has_variable(pid_t pid, const std::string& assignment) {
    std::ifstream file("/proc/" + std::to_string(pid) + "/environ", std::ios::binary);
    for (std::string entry; std::getline(file, entry, '\0');) {
        if (entry == assignment) return true;
    }
    return false;
}

/// The programs that a launcher has left behind, wherever they have put themselves; `server` is the
/// NML server that it has noted.
std::vector<pid_t> left_by(pid_t launcher, pid_t server) {
    const std::string assignment = fmt::format("{}={}", launcher_variable, launcher);
    std::vector<pid_t> all;
    for (const Process& process : processes()) {
        if (process.state == 'Z' || process.pid == ::getpid()) continue;
        const bool noted = server > 0 && process.pid == server && process.name == "linuxcncsvr";
        if (noted || has_variable(process.pid, assignment)) {
            all.push_back(process.pid);
        }
    }
    return all;
}

}  // namespace

/// The launcher that wrote the file was killed. Ends its programs and waits for them: a server that
/// still has the port and the NML buffers, or a task that still has motion's memory, would be in
/// the way of those that start next.
void MachineLock::take_over(const std::string& noted) {
    constexpr int wait_us = 10'000;
    constexpr int max_waits = 500;
    pid_t launcher = 0;
    pid_t server = 0;
    std::istringstream(noted) >> launcher >> server;
    if (launcher <= 0) return;
    std::vector<pid_t> left = left_by(launcher, server);
    took_over_ = true;
    for (const int number :
         {SIGTERM, SIGKILL, SIGKILL,
          SIGKILL}) {  // what is found later was started meanwhile, by one that ignores SIGTERM
        for (const pid_t pid : left) {
            ::kill(pid, number);
            ::kill(pid, SIGCONT);  // one that is stopped would never see it
        }
        for (int waited = 0; waited < max_waits && !left.empty(); ++waited) {
            ::usleep(wait_us);
            std::erase_if(left,
                          [](pid_t pid) { return state_of(pid) == 0 || state_of(pid) == 'Z'; });
        }
        if (left.empty()) {
            left = left_by(launcher, server);
        }
    }
    if (left.empty()) return;
    problem_ =
        fmt::format("process {} of a machine whose launcher was killed does not end; end it first",
                    left.front());
}

MachineLock::~MachineLock() {
    if (file_ < 0) return;
    ::unlink(path_.c_str());
    ::close(file_);
}

void remove_segments(const Configuration& configuration) {
    std::vector<key_t> keys;
    const auto motion = parse_natural(configuration.ini.get("EMCMOT", "SHMEM_KEY").value_or("100"));
    if (motion) {
        keys.push_back(static_cast<key_t>(*motion));
    }
    for (const NmlBuffer& buffer : shared_nml_buffers(configuration.nml)) {
        if (buffer.key) {
            keys.push_back(*buffer.key);
        }
    }
    for (const key_t key : keys) {
        const bool has_semaphores = key != static_cast<key_t>(motion.value_or(0));
        if (remove_segment(key) && has_semaphores) {
            remove_semaphores(key);
        }
    }
}

char state_of(pid_t pid) {
    char content[1024];
    const int file = ::open(fmt::format("/proc/{}/stat", pid).c_str(), O_RDONLY | O_CLOEXEC);
    if (file < 0) return 0;
    const ssize_t length = ::read(file, content, sizeof content);
    ::close(file);
    const std::string_view text(content, length > 0 ? static_cast<std::size_t>(length) : 0);
    const auto end = text.rfind(')');
    return end == text.npos || end + 2 >= text.size() ? '\0' : text[end + 2];
}

void adopt_orphans() { ::prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0); }

std::vector<Child> children() {
    std::vector<Child> all;
    for (const Process& process : processes()) {
        if (process.parent == ::getpid() && process.name != "hal-observer") {
            all.push_back({process.pid, process.name, process.state == 'Z'});
        }
    }
    return all;
}

bool reap(pid_t pid) {
    siginfo_t ended{};
    return ::waitid(P_PID, static_cast<id_t>(pid), &ended, WEXITED | WNOHANG) == 0 &&
           ended.si_pid == pid;
}

}  // namespace hal::tools
