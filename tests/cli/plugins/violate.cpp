// SPDX-License-Identifier: MIT
// Changes, once per new value of `mode`, what belongs to the process or thread around it.
#include <cfenv>
#include <csignal>
#include <cmath>
#include <stdexcept>
#include <string>

#include <fcntl.h>
#include <pthread.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include "hal/component.hpp"

namespace {

/// A system call by its own instruction, which no function of the program sees.
long direct_call(long number, long first) noexcept {
#if defined(__x86_64__)
    long result = number;
    asm volatile("syscall" : "+a"(result) : "D"(first) : "rcx", "r11", "memory");
    return result;
#elif defined(__aarch64__)
    register long call asm("x8") = number;
    register long result asm("x0") = first;
    asm volatile("svc 0" : "+r"(result) : "r"(call) : "memory");
    return result;
#else
    return number + first;
#endif
}

void close_many(long (*how)(int)) noexcept {
    for (int descriptor = 3; descriptor < 64; ++descriptor) {
        how(descriptor);
    }
}

struct Violate : hal::Component {
    explicit Violate(const hal_host* host) : Component(host) { act_in("constructor"); }
    hal::TextArgument in{*this, "in", "", "the call that violates: constructor or start"};
    hal::TextArgument what{*this, "what", "", "fork, fork-exec, close, modes or thread-end"};
    hal::In<std::uint32_t> mode{*this, "mode", "what to change"};
    hal::Out<std::uint32_t> seen{*this, "seen", "cycles in which `look` found other modes"};
    hal::Out<double> out{*this, "out", "1 / 0 while `mode` is 4; else 5", {.safe = -1.0}};
    hal::Out<std::uint64_t> runs{*this, "runs", "cycles of `act`"};
    hal::Function act{*this, "act", &Violate::change, "changes what is around it"};
    hal::Function look{*this, "look", &Violate::look_around, "counts changed modes"};

    void start() { act_in("start"); }

    void change(hal::Cycle) noexcept {
        runs = runs + 1;
        out = 5.0;
        if (mode == 1) {
            std::fesetround(FE_UPWARD);
        }
        if (mode == 4) {
            ::feenableexcept(FE_DIVBYZERO);
            const volatile double zero = 0.0;
            out = 1.0 / zero;
        }
        if (mode == last_) return;
        last_ = mode;
        act_once(last_);
    }
    void look_around(hal::Cycle) noexcept {
        if (std::fegetround() != FE_TONEAREST || ::fegetexcept() != 0 || flushes()) {
            seen = seen + 1;
        }
    }

private:
    static bool flushes() noexcept {
        const volatile double tiny = 2.3e-308;
        const volatile double half = tiny / 2.0;
        return half == 0.0;
    }
    static void flush_to_zero() noexcept {
#if defined(__x86_64__)
        __builtin_ia32_ldmxcsr(__builtin_ia32_stmxcsr() | 0x8040);
#elif defined(__aarch64__)
        __builtin_aarch64_set_fpcr(__builtin_aarch64_get_fpcr() | 0x1000000);
#endif
    }
    static void ignore(pid_t) noexcept {}
    static void lower_limit_of_files() noexcept {
        rlimit none{};
        getrlimit(RLIMIT_NOFILE, &none);
        none.rlim_cur = 0;
        setrlimit(RLIMIT_NOFILE, &none);
    }
    static inline char true_name[] = "true";
    static inline char* true_arguments[] = {true_name, nullptr};
    static void act_once(std::uint32_t how) noexcept {
        switch (how) {
        case 2: std::fesetround(FE_DOWNWARD); break;
        case 3: flush_to_zero(); break;
        case 10: ignore(fork()); break;
        case 11: ignore(_Fork()); break;
        case 12: ignore(vfork()); break;
#ifdef SYS_fork
        case 13: syscall(SYS_fork); break;
        case 14: direct_call(SYS_fork, 0); break;
#endif
        case 20: pthread_exit(nullptr);
        case 21: syscall(SYS_exit, 0); break;
        case 22: direct_call(SYS_exit, 0); break;
        case 23: pthread_cancel(pthread_self()); break;
        case 30: close_many([](int descriptor) noexcept -> long { return close(descriptor); }); break;
        case 31: close_range(3, 63, 0); break;
        case 32: closefrom(3); break;
        case 33: syscall(SYS_close_range, 3, 63, 0); break;
        case 34:
            close_many([](int descriptor) noexcept -> long { return dup2(2, descriptor); });
            break;
        case 35:
            close_many([](int descriptor) noexcept { return direct_call(SYS_close, descriptor); });
            break;
        case 36: replace_all(); break;
        case 50: execl("/bin/true", "true", static_cast<char*>(nullptr)); break;
        case 51: execvp("true", true_arguments); break;
        case 52: execle("/bin/true", "true", static_cast<char*>(nullptr), environ); break;
        case 53: execlp("true", "true", static_cast<char*>(nullptr)); break;
        case 54: execv("/bin/true", true_arguments); break;
        case 55: execve("/bin/true", true_arguments, environ); break;
        case 56: execvpe("true", true_arguments, environ); break;
        case 57: fexecve(0, true_arguments, environ); break;
        case 58: syscall(SYS_execve, "/bin/true", true_arguments, environ); break;
        case 59: execveat(AT_FDCWD, "/bin/true", true_arguments, environ, 0); break;
        case 60: lower_limit_of_files(); break;
        case 40: unblock_all_signals(); break;
        case 41: signal(SIGTERM, SIG_IGN); break;
        case 42: alarm(1); break;
        default: break;
        }
    }
    static void unblock_all_signals() noexcept {
        sigset_t none;
        sigemptyset(&none);
        pthread_sigmask(SIG_SETMASK, &none, nullptr);
    }
    /// The numbers stay open, but belong to another file.
    static void replace_all() noexcept {
        close_many([](int descriptor) noexcept {
            struct stat about{};
            if (fstat(descriptor, &about) != 0) return 0L;
            direct_call(SYS_close, descriptor);
            return static_cast<long>(open("/dev/null", O_RDONLY));
        });
    }

    void act_in(const char* place) {
        if (in.get() != place) return;
        if (what.get() == "fork") {
            ignore(fork());
        } else if (what.get() == "fork-exec") {
            fork_and_execute();
        } else if (what.get() == "close") {
            close_many([](int descriptor) noexcept -> long { return close(descriptor); });
        } else if (what.get() == "modes") {
            std::fesetround(FE_UPWARD);
        } else if (what.get() == "thread-end") {
            pthread_exit(nullptr);
        }
    }
    static void fork_and_execute() {
        const pid_t child = fork();
        if (child == 0) {
            execl("/bin/true", "true", nullptr);
            _exit(1);
        }
        int status = 0;
        if (waitpid(child, &status, 0) != child || status != 0) {
            throw std::runtime_error("the program that the constructor starts failed");
        }
    }

    std::uint32_t last_ = 0;
};

}  // namespace

HAL_COMPONENT(Violate, "violate", "Changes what is around it")
