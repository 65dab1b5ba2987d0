// SPDX-License-Identifier: MIT
// The last resort: a crash signal or an exception inside a cycle. Outputs first, then a report, then the end.
#include <algorithm>
#include <atomic>
#include <csetjmp>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <cxxabi.h>
#include <exception>
#include <unistd.h>

#include "execute/crash_table.hpp"
#include "machine/crash.hpp"
#include "machine/module_library.hpp"

extern "C" [[gnu::weak]] void __rtsan_realtime_enter();  // a program with the real-time guard

namespace hal {
namespace {

std::atomic<SessionState*> watched[64];  // the machines of this process; further ones are not named in reports

void print(const char* text) noexcept { [[maybe_unused]] const auto written = write(STDERR_FILENO, text, std::strlen(text)); }

void print(std::uint64_t number) noexcept {
    char digits[24];
    char* at = digits + sizeof digits;
    *--at = '\0';
    do *--at = static_cast<char>('0' + number % 10);
    while (number /= 10);
    print(at);
}

const char* signal_text(int signal) noexcept {
    switch (signal) {
    case SIGSEGV: return "segmentation fault";
    case SIGBUS: return "bus error";
    case SIGFPE: return "integer division by zero or overflow";
    case SIGILL: return "illegal instruction";
    case SIGSYS: return "invalid system call";
    case SIGTRAP: return "trap";
    default: return "abort";
    }
}

// The process is dying: the model is read without a lock, by pointer only.
void name_function(const Core* core, std::uint32_t id) noexcept {
    for (const auto& one : watched) {
        const SessionState* const state = one.load();
        if (!state || std::none_of(state->cores.begin(), state->cores.end(), [&](const auto& pair) { return pair.second == core; })) continue;
        for (const auto& component : state->model.components)
            for (const auto& function : component->functions)
                if (function->id == id) {
                    print(component->name.c_str());
                    print(": function '");
                    print(function->name.c_str());
                    return print("'");
                }
    }
    print("a function");
}

std::atomic<bool> reported{false};

void on_signal(int signal) {
    if (reported.exchange(true)) {  // by the terminate handler, or a crash while making safe
        raise(signal);
        return;
    }
    make_all_safe();
    print("hal: ");
    if (const Core* const core = Core::current(); core && core->in_function()) {
        name_function(core, core->current_function());
        print(" crashed (");
        print(signal_text(signal));
        print(") at cycle ");
        print(core->cycle_number());
    } else if (const char* const module = module_of_task()) {
        print(module);
        print(": a task of the module's own crashed (");
        print(signal_text(signal));
        print(")");
    } else {
        print("the program crashed outside of the cycle (");
        print(signal_text(signal));
        print(")");
    }
    print("; outputs were set to their safe values; the process ends\n");
    raise(signal);  // SA_RESETHAND put the default action back
}

// A function called exit(), or the real-time guard did because of what the function did.
void on_exit_of_process() {
    Core* const core = Core::current();
    const bool in_function = core && core->in_function();
    const char* const module = in_function ? nullptr : module_of_task();
    if ((!in_function && !module) || reported.exchange(true)) return;
    make_all_safe();
    print("hal: ");
    if (in_function) name_function(core, core->current_function());
    else print(module), print(": a task of the module's own");
    print(__rtsan_realtime_enter ? " made the call that the real-time guard prints above" : " called exit()");
    if (in_function) print(__rtsan_realtime_enter ? ", at cycle " : " at cycle "), print(core->cycle_number());
    print("; outputs were set to their safe values; the process ends\n");
}

// A noexcept function let an exception out. The cycle goes on without the thread's functions.
[[noreturn]] void on_terminate() {
    if (Core* const core = Core::current(); core && core->in_function()) {
        if (std::current_exception()) abi::__cxa_end_catch();  // gives the exception's memory back
        std::longjmp(core->recover, 1);
    }
    if (reported.exchange(true)) std::abort();
    make_all_safe();
    print("hal: an exception outside of the cycle was not caught; outputs were set to their safe values; the process ends\n");
    std::abort();
}

}  // namespace

CycleNames names_of(const CycleNow& now) {
    CycleNames names;
    for (const auto& one : watched) {
        const SessionState* const state = one.load();
        if (!state) continue;
        const auto of = std::find_if(state->cores.begin(), state->cores.end(), [&](const auto& pair) { return pair.second == now.core; });
        if (of == state->cores.end()) continue;
        names.thread = of->first->name;
        for (const auto& component : state->model.components)
            for (const auto& function : component->functions)
                if (function->id == now.function) names.function = "function '" + function->name + "' (" + component->name + ")";
    }
    return names;
}

void watch_for_crashes(SessionState* state) {
    static const bool installed = [] {
        std::set_terminate(on_terminate);
        std::atexit(on_exit_of_process);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
        // for the program's own thread, which runs the cycles of a virtual clock; the executor's threads have one each
        alignas(16) static char room[1 << 15];
        const stack_t other{.ss_sp = room, .ss_flags = 0, .ss_size = sizeof room};
        sigaltstack(&other, nullptr);
        struct sigaction action{};
        action.sa_handler = on_signal;
        action.sa_flags = SA_RESETHAND | SA_NODEFER | SA_ONSTACK;
        for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGSYS, SIGTRAP}) sigaction(signal, &action, nullptr);
#endif
        return true;
    }();
    (void)installed;
    for (auto& place : watched) {
        SessionState* empty = nullptr;
        if (place.compare_exchange_strong(empty, state)) return;
    }
}

void end_watch_for_crashes(SessionState* state) {
    for (auto& place : watched) {
        SessionState* expected = state;
        if (place.compare_exchange_strong(expected, nullptr)) return;
    }
}

}  // namespace hal
