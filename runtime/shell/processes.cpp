// SPDX-License-Identifier: MIT
#include "shell/processes.hpp"

#include <algorithm>
#include <csignal>
#include <cstring>

#include <fcntl.h>
#include <poll.h>
#include <sched.h>
#include <spawn.h>
#include <sys/eventfd.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include "session/session.hpp"
#include "shell/address.hpp"

namespace hal {
namespace {

/// The environment of a child: ours, plus which instance started it, so that `hal shell` in it talks to that one.
std::vector<std::string> environment_of(const std::string& instance) {
    std::vector<std::string> all;
    for (char** entry = environ; *entry; ++entry)
        if (std::strncmp(*entry, "HALCYON_INSTANCE=", 17) != 0) all.push_back(*entry);
    all.push_back("HALCYON_INSTANCE=" + instance);
    return all;
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
        for (auto& entry : entries_)
            if (entry.child) terminate(entry);
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

pid_t Processes::start(const ProcessStart& start, bool waited, std::string& problem) {
    if (wake_ < 0) {
        wake_ = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
        sigset_t all_signals, before;  // signals are for the program's own thread
        sigfillset(&all_signals);
        pthread_sigmask(SIG_SETMASK, &all_signals, &before);
        reaper_ = std::thread([this] { reap(); });
        pthread_sigmask(SIG_SETMASK, &before, nullptr);
    }
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
    const int error = posix_spawnp(&pid, arguments[0].c_str(), &actions, &attributes, pointers(arguments).data(), pointers(environment).data());
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
    entries_.push_back({.pid = pid, .child = true, .waited = waited});
    watched_.push_back({pid, pidfd});
    eventfd_write(wake_, 1);
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

std::string Processes::announce(pid_t pid, const std::string& name) {
    if (!good_instance_name(name)) return "'" + name + "' is no good name for a component";
    Entry* entry = find(name);
    if (entry && entry->ready) return "a component '" + name + "' is there already";
    if (!entry) {
        if (session_.model().find_component(name)) return "a component '" + name + "' is there already";
        entry = find(pid);
        if (entry && entry->ready) return "process " + std::to_string(pid) + " is the component '" + entry->name + "' already";
        if (!entry) entry = &entries_.emplace_back(Entry{.pid = pid});
        if (!entry->name.empty()) session_.remove_process(entry->name);
        entry->name = name;
        session_.add_process(name, pid, Command{});
    }
    entry->ready = true;
    changed_.notify_all();
    return "";
}

void Processes::withdraw(const std::string& name) {
    if (Entry* const entry = find(name)) {
        entry->ready = false;
        if (!entry->child) forget(*entry);
    }
}

Processes::Entry* Processes::find(std::string_view name) {
    const auto at = std::find_if(entries_.begin(), entries_.end(), [&](const Entry& e) { return !e.name.empty() && e.name == name; });
    return at == entries_.end() ? nullptr : &*at;
}

Processes::Entry* Processes::find(pid_t pid) {
    const auto at = std::find_if(entries_.begin(), entries_.end(), [&](const Entry& e) { return e.pid == pid; });
    return at == entries_.end() ? nullptr : &*at;
}

std::vector<std::string> Processes::names() const {
    std::vector<std::string> all;
    for (const auto& entry : entries_)
        if (!entry.name.empty()) all.push_back(entry.name);
    return all;
}

void Processes::collect(pid_t pid) {
    std::erase_if(entries_, [&](const Entry& e) { return e.pid == pid; });
}

void Processes::abandon(pid_t pid) {
    if (Entry* const entry = find(pid)) {
        entry->waited = false;
        if (entry->ended) collect(pid);
    }
}

bool Processes::terminate(Entry& entry) { return !entry.ended && kill(entry.pid, SIGTERM) == 0; }

void Processes::forget(Entry& entry) {
    if (!entry.name.empty()) session_.remove_process(entry.name);
    entry.name.clear();
    if (!entry.waited) collect(entry.pid);
    changed_.notify_all();
}

void Processes::reap() {
    std::vector<pollfd> waiting;
    std::unique_lock lock(session_.mutex);
    while (!ending_) {
        waiting.assign(1, {wake_, POLLIN, 0});
        for (const auto& child : watched_) waiting.push_back({child.pidfd, POLLIN, 0});
        lock.unlock();
        poll(waiting.data(), waiting.size(), -1);
        lock.lock();
        eventfd_t ignored;
        eventfd_read(wake_, &ignored);
        for (auto child = watched_.begin(); child != watched_.end();) {
            siginfo_t info{};
            if (waitid(P_PID, static_cast<id_t>(child->pid), &info, WEXITED | WNOHANG) != 0 || info.si_pid == 0) {
                ++child;
                continue;
            }
            if (Entry* const entry = find(child->pid)) {
                entry->ended = true;
                entry->status = info.si_code == CLD_EXITED ? info.si_status : 128 + info.si_status;
                forget(*entry);
            }
            close(child->pidfd);
            child = watched_.erase(child);
        }
        changed_.notify_all();
    }
}

}  // namespace hal
