// SPDX-License-Identifier: MIT
#include "machine/report/exit_observer.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <new>

#include <fcntl.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/own_descriptors.hpp"
#include "hal/system_log.hpp"
#include "model/model.hpp"
#include "text/quoting.hpp"

namespace hal {
namespace {

constexpr off_t max_text = off_t{1} << 26;  // per thread; the file is sparse
std::atomic<std::atomic<bool>*> silent_flag{nullptr};

[[noreturn]] void end_observer() {
    for (;;) {
        ::syscall(SYS_exit_group, 0);
    }
}

/// Of the observer: it holds nothing of the machine's except its standard error, and no signal that
/// is for the machine ends it.
void let_go(int parent, int names) {
    for (int number = 1; number < NSIG; ++number) {
        ::signal(number, SIG_IGN);
    }
    ::signal(SIGSEGV, SIG_DFL);
    ::prctl(PR_SET_NAME, "hal-observer");
    const int nothing = ::open("/dev/null", O_RDWR | O_CLOEXEC);
    ::dup2(nothing, STDIN_FILENO);
    ::dup2(nothing, STDOUT_FILENO);
    const long limit = std::min<long>(::sysconf(_SC_OPEN_MAX), 65536);
    int from = 3;
    std::array<int, 2> kept{parent, names};
    std::sort(kept.begin(), kept.end());
    for (const int one : kept) {
        if (one < from) continue;
        if (one > from && ::syscall(SYS_close_range, from, one - 1, 0) != 0) {
            for (int file = from; file < one; ++file) {
                ::close(file);
            }
        }
        from = one + 1;
    }
    if (::syscall(SYS_close_range, from, ~0U, 0) != 0) {
        for (int file = from; file < limit; ++file) {
            ::close(file);
        }
    }
    if (::chdir("/") != 0) return;
}

/// Shows another command line in `ps`, so that nobody takes the observer for a second machine.
void rename_command_line() {
    char* const first = ::program_invocation_name;
    const int file = ::open("/proc/self/cmdline", O_RDONLY | O_CLOEXEC);
    char text[4096];
    const ssize_t length = file < 0 ? 0 : ::read(file, text, sizeof text);
    if (file >= 0) {
        ::close(file);
    }
    if (length <= 1 || std::memcmp(first, text, std::strlen(first) + 1) != 0) return;
    std::memset(first, 0, static_cast<std::size_t>(length));
    std::strncpy(first, "hal-observer", static_cast<std::size_t>(length) - 1);
}

/// Standard error may be a file on a full disk, or a pipe whose reader has ended.
void print_line(const std::string& text) {
    if (!write_whole(STDERR_FILENO, text)) {
        write_system_log("hal", text);
    }
}

/// One thread as describe() wrote it: a line "BASE THREAD", then "END NAME" per function, END being
/// the index behind its last step.
struct Described {
    std::uintptr_t base = 0;
    std::string thread, functions;

    std::string function_at(const plan::Step* step) const {
        const std::uintptr_t index =
            (reinterpret_cast<std::uintptr_t>(step) - base) / sizeof(plan::Step);
        const char* at = functions.data();
        const char* const end = at + functions.size();
        while (at < end) {
            const char* const line_end = std::find(at, end, '\n');
            std::uintptr_t behind = 0;
            const auto [name, problem] = std::from_chars(at, line_end, behind);
            if (problem != std::errc{} || name == line_end) return "";
            if (index < behind) return std::string(name + 1, line_end);
            at = line_end + 1;
        }
        return "";
    }
};

bool read_description(int file, std::size_t index, Described& described) {
    std::string text;
    std::array<char, 4096> part;
    for (off_t at = 0; at < max_text;) {
        const ssize_t got =
            ::pread(file, part.data(), part.size(), static_cast<off_t>(index) * max_text + at);
        if (got <= 0) break;
        const char* const end = std::find(part.data(), part.data() + got, '\0');
        text.append(part.data(), static_cast<std::size_t>(end - part.data()));
        if (end != part.data() + got) break;
        at += got;
    }
    const auto first = std::from_chars(text.data(), text.data() + text.size(), described.base, 16);
    const auto line_end = text.find('\n');
    if (first.ec != std::errc{} || line_end == std::string::npos) return false;
    described.thread =
        text.substr(static_cast<std::size_t>(first.ptr + 1 - text.data()),
                    static_cast<std::size_t>(text.data() + line_end - first.ptr - 1));
    described.functions = text.substr(line_end + 1);
    return true;
}

void wait_for_end(int parent, pid_t machine) {
    pollfd end{parent, POLLIN, 0};
    while (parent >= 0) {
        if (::poll(&end, 1, -1) > 0 || errno != EINTR) return;
    }
    constexpr timespec pause{0, 100'000'000};  // a kernel before 5.3
    while (::getppid() == machine) {
        ::nanosleep(&pause, nullptr);
    }
}

}  // namespace

struct ExitObserver::Shared {
    std::atomic<bool> silent{false};
    char name[80]{};
    std::array<CycleMark, max_threads> marks;
};

ExitObserver::ExitObserver(const std::string& name) {
    void* const memory =
        ::mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED) return;
    shared_ = new (memory) Shared;
    name.copy(shared_->name, sizeof shared_->name - 1);
    names_ = static_cast<int>(::syscall(SYS_memfd_create, "hal-functions", MFD_CLOEXEC));
    const pid_t machine = ::getpid();
    const int parent = static_cast<int>(::syscall(SYS_pidfd_open, machine, 0));
    if (parent >= 0) {
        ::fcntl(parent, F_SETFD, FD_CLOEXEC);
    }
    observer_ = names_ < 0 ? -1 : ::fork();
    if (observer_ == 0) {
        observe(parent, machine);
    }
    if (parent >= 0) {
        ::close(parent);
    }
    list_descriptor(names_, "the function names for the observer");
    silent_flag = &shared_->silent;
}

ExitObserver::~ExitObserver() {
    silent_flag = nullptr;
    if (observer_ > 0) {
        shared_->silent = true;
        ::kill(observer_, SIGKILL);
        while (::waitpid(observer_, nullptr, 0) < 0 && errno == EINTR) {
        }
    }
    if (names_ >= 0) {
        close_own(names_);
    }
    // shared_ stays: a thread that hangs may still use its mark
}

void ExitObserver::silence() noexcept {
    if (std::atomic<bool>* const flag = silent_flag.load()) {
        flag->store(true);
    }
}

CycleMark* ExitObserver::take_mark() {
    if (observer_ <= 0) return nullptr;
    const auto free = std::find(taken_.begin(), taken_.end(), false);
    if (free == taken_.end()) return nullptr;
    *free = true;
    return &shared_->marks[static_cast<std::size_t>(free - taken_.begin())];
}

void ExitObserver::give_back(const CycleMark* mark) {
    if (mark) {
        taken_[static_cast<std::size_t>(mark - shared_->marks.data())] = false;
    }
}

void ExitObserver::describe(const CycleMark* mark, const Thread& thread,
                            const plan::Plan& plan) noexcept {
    if (!mark) return;
    try {
        char number[32];
        const auto add_number = [&](std::string& text, std::uintptr_t value, int radix) {
            text.append(number, std::to_chars(number, number + sizeof number, value, radix).ptr);
        };
        std::string text;
        add_number(text, reinterpret_cast<std::uintptr_t>(plan.steps.data()), 16);
        text += " " + thread.name + "\n";
        auto function = thread.functions.begin();
        for (const plan::Function& planned : plan.functions) {
            function = std::find_if(function, thread.functions.end(),
                                    [&](const auto& one) { return one->id == planned.id; });
            if (function == thread.functions.end()) break;
            add_number(text, planned.end, 10);
            text += " '" + (*function)->name + "' (" + (*function)->component->name + ")\n";
        }
        text += '\0';
        const off_t at = (mark - shared_->marks.data()) * max_text;
        if (text.size() >= static_cast<std::size_t>(max_text)) return;
        [[maybe_unused]] const auto written = ::pwrite(names_, text.data(), text.size(), at);
    } catch (const std::bad_alloc&) {
    }  // then the plan before is named
}

void ExitObserver::observe(int parent, pid_t machine) const {
    let_go(parent, names_);
    rename_command_line();
    wait_for_end(parent, machine);
    if (!shared_->silent) {
        report(machine);
    }
    end_observer();
}

void ExitObserver::report(pid_t machine) const {
    std::string running;
    for (std::size_t i = 0; i < max_threads; ++i) {
        const CycleMark& mark = shared_->marks[i];
        Described described;
        if (!mark.in_function || !read_description(names_, i, described)) continue;
        const std::string function = described.function_at(mark.current);
        append_item(running,
                    ("thread '" + described.thread + "' ran ") +
                        (function.empty() ? std::string("a function") : "function " + function));
    }
    print_line("hal: machine '" + std::string(shared_->name) + "' (process " +
               std::to_string(machine) + ") ended without shutting down: " +
               (running.empty()
                    ? "it was killed outside of a cycle"
                    : "it was killed, or a function ended it by a system call; " + running) +
               "; its outputs were not set to their safe values\n");
}

}  // namespace hal
