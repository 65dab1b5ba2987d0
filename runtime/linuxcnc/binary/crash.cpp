// SPDX-License-Identifier: MIT
// A crash in a module's set-up code is an error of that command. One in a cycle is the runtime's
// (machine/report/crash.cpp).
#include <csetjmp>
#include <csignal>
#include <cstdlib>

#include "linuxcnc/binary/module.hpp"

namespace hal::modules {
namespace {

constexpr int signals[] = {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGTRAP};
struct sigaction before[NSIG];
thread_local sigjmp_buf* jump __attribute__((tls_model("initial-exec"))) = nullptr;

void on_crash(int signal) {
    if (sigjmp_buf* const to = jump) {
        jump = nullptr;
        siglongjmp(*to, signal);
    }
    sigaction(signal, &before[signal], nullptr);  // another thread's: as without this
    raise(signal);
}

}  // namespace

int run_guarded_from_crashes(void (*action)(void*), void* argument) noexcept {
    sigjmp_buf here;
    struct sigaction guard{};
    guard.sa_handler = on_crash;
    guard.sa_flags = SA_NODEFER | SA_ONSTACK;
    for (const int signal : signals) {
        sigaction(signal, &guard, &before[signal]);
    }
    const int crashed = sigsetjmp(here, 1);
    if (crashed == 0) {
        jump = &here;
        action(argument);
    }
    jump = nullptr;
    for (const int signal : signals) {
        sigaction(signal, &before[signal], nullptr);
    }
    return crashed;
}

const char* crash_text(int signal) noexcept {
    switch (signal) {
    case SIGSEGV: return "segmentation fault";
    case SIGBUS: return "bus error";
    case SIGFPE: return "integer division by zero or overflow";
    case SIGILL: return "illegal instruction";
    case SIGTRAP: return "trap";
    default: return "abort";
    }
}

}  // namespace hal::modules
