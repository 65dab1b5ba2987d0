// SPDX-License-Identifier: MIT
#include "shell/processes.hpp"

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include <fcntl.h>
#include <poll.h>
#include <sched.h>
#include <spawn.h>
#include <sys/eventfd.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include "paths.hpp"
#include "session/plugins.hpp"
#include "session/session.hpp"

namespace hal {
namespace {

/// `folders` before those of a variable like PATH, as far as they are there and not among those already.
std::string with_folders(const char* variable, const std::vector<std::string>& folders) {
    const char* const before = std::getenv(variable);
    const std::string there = before ? before : "";
    std::string all;
    for (const std::string& folder : folders) {
        std::error_code ignored;
        if ((":" + there + ":").find(":" + folder + ":") == std::string::npos && std::filesystem::is_directory(folder, ignored))
            all += folder + ":";
    }
    all += there;
    if (all.ends_with(':')) all.pop_back();
    return all;
}

/// The environment of a child: ours, plus which instance started it, so that `hal shell` in it talks to that one; and our own
/// programs and Python module are found.
std::vector<std::string> environment_of(const std::string& instance) {
    std::error_code ignored;
    const auto program = std::filesystem::read_symlink("/proc/self/exe", ignored);
    const std::pair<std::string, std::string> ours[] = {
        {"HALCYON_INSTANCE=", instance},
        {"PATH=", with_folders("PATH", {program.parent_path().string(), user_folder("bin")})},
        {"PYTHONPATH=", with_folders("PYTHONPATH", {std::string(paths::build_python), std::string(paths::install_python)})}};
    std::vector<std::string> all;
    for (char** entry = environ; *entry; ++entry)
        if (std::none_of(std::begin(ours), std::end(ours),
                         [&](const auto& one) { return std::string_view(*entry).starts_with(one.first); }))
            all.push_back(*entry);
    for (const auto& [name, value] : ours)
        if (!value.empty()) all.push_back(name + value);
    return all;
}

/// Where the PATH of `environment` has the program; `name` itself when it is a path, or nowhere.
std::string program_in(const std::vector<std::string>& environment, const std::string& name) {
    if (name.find('/') != std::string::npos) return name;
    for (const std::string& entry : environment) {
        if (!entry.starts_with("PATH=")) continue;
        for (std::size_t at = 5, end = 0; at < entry.size(); at = end + 1) {
            end = std::min(entry.find(':', at), entry.size());
            const std::string file = entry.substr(at, end - at) + "/" + name;
            std::error_code ignored;
            if (access(file.c_str(), X_OK) == 0 && !std::filesystem::is_directory(file, ignored)) return file;
        }
    }
    return name;
}

std::vector<char*> pointers(std::vector<std::string>& texts) {
    std::vector<char*> all;
    for (auto& text : texts) all.push_back(text.data());
    all.push_back(nullptr);
    return all;
}

}  // namespace

Processes::Processes(Session& session) : session_(session) {}

Processes::~Processes() {
    {
        std::unique_lock lock(session_.mutex);
        const auto living = [&] {
            return std::any_of(entries_.begin(), entries_.end(), [](const Entry& e) { return e.child && !e.ended; });
        };
        ending_children_ = true;
        for (auto& entry : entries_)
            if (entry.child && !entry.ended) kill(entry.pid, SIGTERM);
        changed_.wait_for(lock, std::chrono::seconds(2), [&] { return !living(); });
        for (const auto& entry : entries_)
            if (entry.child && !entry.ended) kill(entry.pid, SIGKILL);
        changed_.wait_for(lock, std::chrono::seconds(2), [&] { return !living(); });
        ending_ = true;
        if (wake_ >= 0) eventfd_write(wake_, 1);
    }
    if (reaper_.joinable()) reaper_.join();
    if (wake_ >= 0) close(wake_);
    for (const auto& child : watched_) close(child.pidfd);
}

void Processes::work() {
    if (wake_ >= 0) {
        eventfd_write(wake_, 1);
        return;
    }
    wake_ = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    sigset_t all_signals, before;  // signals are for the program's own thread
    sigfillset(&all_signals);
    pthread_sigmask(SIG_SETMASK, &all_signals, &before);
    reaper_ = std::thread([this] { reap(); });
    pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

pid_t Processes::start(const ProcessStart& start, bool waited, std::string& problem) {
    const pid_t pid = spawn(start, problem);
    if (pid != 0) entries_.push_back({.pid = pid, .child = true, .waited = waited});
    return pid;
}

pid_t Processes::spawn(const ProcessStart& start, std::string& problem) {
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    if (!start.keep_stdin) posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
    if (start.out >= 0) posix_spawn_file_actions_adddup2(&actions, start.out, 1);
    if (start.err >= 0) posix_spawn_file_actions_adddup2(&actions, start.err, 2);
    if (!start.directory.empty()) posix_spawn_file_actions_addchdir_np(&actions, start.directory.c_str());

    // A child starts as an ordinary program, whatever this thread blocks, ignores or is scheduled as.
    posix_spawnattr_t attributes;
    posix_spawnattr_init(&attributes);
    sigset_t none, all;
    sigemptyset(&none);
    sigfillset(&all);
    const sched_param ordinary{};
    posix_spawnattr_setsigmask(&attributes, &none);
    posix_spawnattr_setsigdefault(&attributes, &all);
    posix_spawnattr_setschedpolicy(&attributes, SCHED_OTHER);
    posix_spawnattr_setschedparam(&attributes, &ordinary);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETSCHEDULER);

    auto arguments = start.arguments;
    auto environment = environment_of(session_.options().name);
    pid_t pid = 0;
    const int error = posix_spawnp(&pid, program_in(environment, arguments[0]).c_str(), &actions, &attributes, pointers(arguments).data(),
                                   pointers(environment).data());
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&actions);
    if (error != 0) {
        problem = std::strerror(error);
        return 0;
    }
    const int pidfd = static_cast<int>(syscall(SYS_pidfd_open, pid, 0));  // glibc 2.36's header cannot be used from C++
    if (pidfd < 0) {
        problem = std::string("its end cannot be watched: ") + std::strerror(errno);
        kill(pid, SIGKILL);
        waitpid(pid, nullptr, 0);
        return 0;
    }
    watched_.push_back({pid, pidfd});
    work();
    return pid;
}

std::string Processes::add(pid_t pid, const std::string& name, const Command& command) {
    std::string unique = name;
    for (int number = 2; session_.model().find_component(unique) || find(unique); ++number) unique = name + "-" + std::to_string(number);
    if (Entry* const entry = find(pid); entry && !entry->ended) {
        entry->name = unique;
        session_.add_process(unique, pid, command);
    }
    return unique;
}

Processes::Entry* Processes::find(std::string_view name) {
    const auto at = std::find_if(entries_.begin(), entries_.end(), [&](const Entry& e) { return !e.name.empty() && e.name == name; });
    return at == entries_.end() ? nullptr : &*at;
}

Processes::Entry* Processes::find(pid_t pid) {
    const auto at = std::find_if(entries_.begin(), entries_.end(),
                                 [&](const Entry& e) { return e.pid == pid && (!e.dead() || (e.child && !e.ended)); });
    return at == entries_.end() ? nullptr : &*at;
}

std::vector<std::string> Processes::names() const {
    std::vector<std::string> all;
    for (const auto& entry : entries_)
        if (!entry.name.empty()) all.push_back(entry.name);
    return all;
}

void Processes::collect(pid_t pid) {
    std::erase_if(entries_, [&](const Entry& e) { return e.pid == pid && !e.dead(); });
}

void Processes::abandon(pid_t pid) {
    if (Entry* const entry = find(pid)) {
        entry->waited = false;
        if (entry->ended) collect(pid);
    }
}


void Processes::reap() {
    std::vector<pollfd> waiting;
    std::unique_lock lock(session_.mutex);
    while (!ending_) {
        waiting.assign(1, {wake_, POLLIN, 0});
        for (const auto& child : watched_) waiting.push_back({child.pidfd, POLLIN, 0});
        const int most = sleep_ms();
        lock.unlock();
        poll(waiting.data(), waiting.size(), most);
        lock.lock();
        eventfd_t ignored;
        eventfd_read(wake_, &ignored);
        for (auto child = watched_.begin(); child != watched_.end();) {
            siginfo_t info{};
            if (waitid(P_PID, static_cast<id_t>(child->pid), &info, WEXITED | WNOHANG) != 0 || info.si_pid == 0) {
                ++child;
                continue;
            }
            const pid_t pid = child->pid;
            close(child->pidfd);
            child = watched_.erase(child);
            child_ended(pid, info.si_code == CLD_EXITED ? info.si_status : 128 + info.si_status);
        }
        if (!ending_) act_in_time();
        changed_.notify_all();
    }
}

}  // namespace hal
