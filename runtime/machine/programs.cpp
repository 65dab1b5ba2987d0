// SPDX-License-Identifier: MIT
#include "machine/programs.hpp"

#include <algorithm>
#include <csignal>
#include <cstring>

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include "execute/process_setup.hpp"
#include "machine/session.hpp"

namespace hal {

Programs::Programs(Session& session, SessionState& state) : session_(session), state_(state) {}

Programs::~Programs() {
    {
        SessionLock lock = session_.lock();
        const auto living = [&] {
            return std::any_of(entries_.begin(), entries_.end(),
                               [](const Entry& e) { return e.child && !e.ended; });
        };
        ending_children_ = true;
        for (auto& entry : entries_) {
            if (entry.child && !entry.ended) {
                kill(entry.pid, SIGTERM);
            }
        }
        changed_.wait_for(lock, std::chrono::seconds(2), [&] { return !living(); });
        for (const auto& entry : entries_) {
            if (entry.child && !entry.ended) {
                kill(entry.pid, SIGKILL);
            }
        }
        changed_.wait_for(lock, std::chrono::seconds(2), [&] { return !living(); });
        ending_ = true;
        if (wake_ >= 0) {
            eventfd_write(wake_, 1);
        }
    }
    if (reaper_.joinable()) {
        reaper_.join();
    }
    spawner_.reset();
    if (wake_ >= 0) {
        close(wake_);
    }
    for (const auto& child : watched_) {
        close(child.pidfd);
    }
}

void Programs::work() {
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

pid_t Programs::start(const ProcessStart& start, bool waited, std::string& problem) {
    const pid_t pid = spawn(start, problem);
    if (pid != 0) {
        entries_.push_back({.number = ++numbers_, .pid = pid, .child = true, .waited = waited});
    }
    return pid;
}

pid_t Programs::spawn(const ProcessStart& start, std::string& problem) {
    if (!spawner_) {
        spawner_ = std::make_unique<Spawner>();
    }
    const pid_t pid = spawner_->start(start, session_.options().name, problem);
    if (pid == 0) return 0;
    std::erase_if(refusals_, [&](const auto& refusal) { return refusal.first == pid; });
    // glibc 2.36's header cannot be used from C++
    const int pidfd = static_cast<int>(syscall(SYS_pidfd_open, pid, 0));
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

std::uint64_t Programs::add(pid_t pid, const std::string& name, const Command& command,
                            bool reserved) {
    Entry* const started = find(pid);
    if (!started || started->ended) return 0;
    const std::uint64_t number = started->number;
    // its pins and links wait for the new program
    if (Entry* const dead = reserved ? find(name) : nullptr; dead && dead->dead()) {
        dead->number = number;
        dead->pid = pid;
        dead->child = dead->again = dead->reserved = true;
        dead->ended = dead->stopping = false;
        dead->restart = {};
        dead->restarts.clear();
        std::erase_if(entries_,
                      [&](const Entry& e) { return e.number == number && e.name.empty(); });
        replace_in_model(name, pid);
        return number;
    }
    std::string unique = name;
    for (int i = 2; session_.model().find_component(unique) || find(unique); ++i) {
        unique = name + "-" + std::to_string(i);
    }
    started->name = unique;
    started->reserved = reserved;
    add_to_model(unique, pid, command);
    return number;
}

Programs::Entry* Programs::find(std::string_view name) {
    const auto at = std::find_if(entries_.begin(), entries_.end(),
                                 [&](const Entry& e) { return !e.name.empty() && e.name == name; });
    return at == entries_.end() ? nullptr : &*at;
}

Programs::Entry* Programs::find(pid_t pid) {
    const auto at = std::find_if(entries_.begin(), entries_.end(), [&](const Entry& e) {
        return e.pid == pid && (!e.dead() || (e.child && !e.ended));
    });
    return at == entries_.end() ? nullptr : &*at;
}

Programs::Entry* Programs::find_number(std::uint64_t number) {
    const auto at = std::find_if(entries_.begin(), entries_.end(),
                                 [&](const Entry& e) { return e.number == number; });
    return at == entries_.end() ? nullptr : &*at;
}

bool Programs::answers(std::uint64_t owner) const {
    return std::any_of(entries_.begin(), entries_.end(),
                       [&](const Entry& e) { return e.owner == owner; });
}

std::string Programs::refusal_of(pid_t pid) const {
    const auto at = std::find_if(refusals_.begin(), refusals_.end(),
                                 [&](const auto& refusal) { return refusal.first == pid; });
    return at == refusals_.end() ? "" : at->second;
}

std::vector<std::string> Programs::registered_by(pid_t pid) const {
    std::vector<std::string> all;
    for (const auto& entry : entries_) {
        if (entry.pid == pid && !entry.dead() && (entry.ready || entry.owner != 0)) {
            all.push_back(entry.name);
        }
    }
    return all;
}

std::vector<std::string> Programs::names() const {
    std::vector<std::string> all;
    for (const auto& entry : entries_) {
        if (!entry.name.empty()) {
            all.push_back(entry.name);
        }
    }
    return all;
}

void Programs::collect(pid_t pid) {
    std::erase_if(entries_, [&](const Entry& e) { return e.pid == pid && !e.dead(); });
}

void Programs::abandon(pid_t pid) {
    if (Entry* const entry = find(pid)) {
        entry->waited = false;
        if (entry->ended) {
            collect(pid);
        }
    }
}

void Programs::reap() {
    release_unused_stack();
    std::vector<pollfd> waiting;
    SessionLock lock = session_.lock();
    while (!ending_) {
        const auto before = std::chrono::steady_clock::now();
        waiting.assign(1, {wake_, POLLIN, 0});
        for (const auto& child : watched_) {
            waiting.push_back({child.pidfd, POLLIN, 0});
        }
        const int most = sleep_ms();
        lock.unlock();
        poll(waiting.data(), waiting.size(), most);
        lock.lock();
        eventfd_t ignored;
        eventfd_read(wake_, &ignored);
        for (auto child = watched_.begin(); child != watched_.end();) {
            siginfo_t info{};
            if (waitid(P_PID, static_cast<id_t>(child->pid), &info, WEXITED | WNOHANG) != 0 ||
                info.si_pid == 0) {
                ++child;
                continue;
            }
            const pid_t pid = child->pid;
            close(child->pidfd);
            child = watched_.erase(child);
            child_ended(pid, info.si_code == CLD_EXITED ? info.si_status : 128 + info.si_status);
        }
        const std::chrono::nanoseconds slept = std::chrono::steady_clock::now() - before;
        if (!ending_) {
            act_in_time(most < 0 ? 0 : slept.count() - std::int64_t{most} * 1'000'000);
        }
        changed_.notify_all();
    }
}

}  // namespace hal
