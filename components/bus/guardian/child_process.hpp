// SPDX-License-Identifier: MIT
// A guardian as its component sees it: starts the process, shares memory with it, ends it.
#pragma once

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "bus/guardian/ambient_capabilities.hpp"
#include "bus/guardian/start_state.hpp"
#include "link/system.hpp"

extern char** environ;

namespace hal::bus {

/// Descriptors of a guardian.
inline constexpr int guardian_memory_fd = 3;
inline constexpr int guardian_text_fd = 4;
inline constexpr int guardian_lock_fd = 5;  ///< of ReportLock; never read

class ChildProcess {
public:
    ChildProcess() = default;
    ~ChildProcess() {
        if (memory_ != nullptr) {
            munmap(memory_, size_);
        }
    }
    ChildProcess(const ChildProcess&) = delete;

    /// Maps memory of zeros for both processes, and keeps a text for the guardian. Returns the
    /// problem, or "". [setup]
    std::string map(std::size_t size, std::string_view text) {
        size_ = size;
        memory_fd_ = link::Descriptor(memfd_create("guardian-memory", MFD_CLOEXEC));
        text_fd_ = link::Descriptor(memfd_create("guardian-text", MFD_CLOEXEC));
        if (!memory_fd_ || !text_fd_ ||
            ftruncate(memory_fd_.get(), static_cast<off_t>(size)) != 0 ||
            ::write(text_fd_.get(), text.data(), text.size()) !=
                static_cast<ssize_t>(text.size())) {
            return "no memory for the guardian: " + link::reason();
        }
        void* const mapped = mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_POPULATE,
                                  memory_fd_.get(), 0);
        if (mapped == MAP_FAILED) return "no memory for the guardian: " + link::reason();
        memory_ = mapped;
        return {};
    }
    void* memory() const noexcept { return memory_; }

    /// Starts the program `arguments[0]` with these arguments and the number of this process, and
    /// waits until `start`, in the memory, shows that it watches. `lock` is a descriptor that it
    /// inherits, or -1. Once this process has ended, it may be started again: with the same memory.
    /// Returns the problem, or "". [setup]
    std::string start(std::vector<std::string> arguments, StartState& start, int lock) {
        start.begin();
        std::string problem = spawn(std::move(arguments), lock);
        if (problem.empty()) {
            problem = await(start);
        }
        if (!problem.empty()) {
            kill();
        }
        return problem;
    }

    bool is_running() const noexcept { return pid_ >= 0; }
    /// Waits for its end, for at most `limit_ns`. Returns whether it has ended; called by a thread
    /// that may wait.
    bool has_ended_within(std::int64_t limit_ns) noexcept {
        if (pid_ < 0) return true;
        if (!link::readable_within(process_.get(), limit_ns)) return false;
        waitpid(pid_, nullptr, WNOHANG);
        pid_ = -1;
        return true;
    }
    /// Continues a guardian that was suspended by a signal. Belongs to the thread that starts it.
    void resume() const noexcept {
        if (process_) {
            syscall(SYS_pidfd_send_signal, process_.get(), SIGCONT, nullptr, 0);
        }
    }
    /// Kills it, and waits for its end for at most a second: a debugger may hold its remains.
    /// [setup]
    void kill() noexcept {
        if (pid_ < 0) return;
        ::kill(pid_, SIGKILL);
        has_ended_within(1'000'000'000);
        pid_ = -1;
    }

private:
    static constexpr std::int64_t start_limit_ns = 3'000'000'000;

    /// A session of its own, so that Ctrl-C and a closed terminal miss it, and no signal mask of
    /// the runtime.
    struct Attributes {
        Attributes() {
            posix_spawnattr_init(&attributes);
            posix_spawn_file_actions_init(&actions);
            sigset_t empty;
            sigemptyset(&empty);
            posix_spawnattr_setsigmask(&attributes, &empty);
            sigset_t all;
            sigfillset(&all);
            posix_spawnattr_setsigdefault(&attributes, &all);
            posix_spawnattr_setflags(
                &attributes, POSIX_SPAWN_SETSID | POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
        }
        ~Attributes() {
            posix_spawnattr_destroy(&attributes);
            posix_spawn_file_actions_destroy(&actions);
        }
        posix_spawnattr_t attributes;
        posix_spawn_file_actions_t actions;
    };

    std::string spawn(std::vector<std::string> arguments, int lock) {
        Attributes attributes;
        // dup2 onto the same number would keep O_CLOEXEC, so all go through numbers above
        const link::Descriptor memory(fcntl(memory_fd_.get(), F_DUPFD_CLOEXEC, 16));
        const link::Descriptor text(fcntl(text_fd_.get(), F_DUPFD_CLOEXEC, 16));
        const link::Descriptor locked(lock < 0 ? ::open("/dev/null", O_RDONLY | O_CLOEXEC)
                                               : fcntl(lock, F_DUPFD_CLOEXEC, 16));
        if (!memory || !text || !locked) {
            return "no descriptors for the guardian: " + link::reason();
        }
        posix_spawn_file_actions_adddup2(&attributes.actions, memory.get(), guardian_memory_fd);
        posix_spawn_file_actions_adddup2(&attributes.actions, text.get(), guardian_text_fd);
        posix_spawn_file_actions_adddup2(&attributes.actions, locked.get(), guardian_lock_fd);
        posix_spawn_file_actions_addopen(&attributes.actions, 0, "/dev/null", O_RDONLY, 0);
        posix_spawn_file_actions_addopen(&attributes.actions, 1, "/dev/null", O_WRONLY, 0);
        arguments.push_back(std::to_string(getpid()));
        std::vector<char*> argv;
        for (std::string& argument : arguments) {
            argv.push_back(argument.data());
        }
        argv.push_back(nullptr);
        int error = 0;
        {
            const AmbientCapabilities capabilities;
            error = posix_spawn(&pid_, arguments[0].c_str(), &attributes.actions,
                                &attributes.attributes, argv.data(), environ);
        }
        if (error != 0) {
            pid_ = -1;
            return "cannot start the guardian '" + arguments[0] + "': " + link::reason(error);
        }
        process_ = link::Descriptor(static_cast<int>(syscall(SYS_pidfd_open, pid_, 0)));
        if (!process_) {
            const std::string problem = "cannot watch the guardian: " + link::reason();
            ::kill(pid_, SIGKILL);
            waitpid(pid_, nullptr, 0);
            pid_ = -1;
            return problem;
        }
        return {};
    }

    /// Waits until the guardian watches. Returns the problem, or "".
    std::string await(const StartState& start) {
        const std::int64_t limit = link::monotonic_ns() + start_limit_ns;
        while (start.phase() == StartState::Phase::starting) {
            const bool has_ended = has_ended_within(2'000'000);
            if (!has_ended && link::monotonic_ns() < limit) continue;
            if (start.phase() != StartState::Phase::starting) break;
            return has_ended ? "the guardian has ended during its start"
                             : "the guardian did not start within 3 s";
        }
        if (start.phase() == StartState::Phase::rejected) return start.problem();
        return {};
    }

    link::Descriptor memory_fd_, text_fd_;
    void* memory_ = nullptr;
    std::size_t size_ = 0;
    pid_t pid_ = -1;
    link::Descriptor process_;
};

}  // namespace hal::bus
