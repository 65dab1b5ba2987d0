// SPDX-License-Identifier: MIT
// The last resort: a crash signal or an exception inside a cycle. Outputs first, then a report,
// then the end.
#include <algorithm>
#include <atomic>
#include <csetjmp>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <cxxabi.h>
#include <exception>
#include <pthread.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "base/process_copy.hpp"
#include "execute/crash_table.hpp"
#include "linuxcnc/find/modules.hpp"
#include "machine/load/module_library.hpp"
#include "machine/load/setup_call.hpp"
#include "machine/report/crash.hpp"
#include "machine/report/exit_observer.hpp"
#include "machine/report/process_calls.hpp"
#include "model/model.hpp"

extern "C" [[gnu::weak]] void __rtsan_realtime_enter();  // a program with the real-time guard

namespace hal {
namespace {

// the machines of this process; further ones are not named in reports
std::atomic<const MachineView*> watched[64];

void print(const char* text) noexcept {
    [[maybe_unused]] const auto written = write(STDERR_FILENO, text, std::strlen(text));
}

void print(std::uint64_t number) noexcept {
    char digits[24];
    char* at = digits + sizeof digits;
    *--at = '\0';
    do {
        *--at = static_cast<char>('0' + number % 10);
    } while (number /= 10);
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
        const MachineView* const machine = one.load();
        if (!machine || std::none_of(machine->cores.begin(), machine->cores.end(),
                                     [&](const auto& pair) { return pair.second == core; })) {
            continue;
        }
        for (const auto& component : machine->model.components) {
            for (const auto& function : component->functions) {
                if (function->id == id) {
                    print(component->name.c_str());
                    print(": function '");
                    print(function->name.c_str());
                    return print("'");
                }
            }
        }
    }
    print("a function");
}

std::atomic<bool> reported{false};

void install_crash_handler(int signal) noexcept;

/// A floating-point exception traps only when a function has unmasked it. Masks it, so that the
/// instruction gives its default result; the cycle reports the function. Returns false when it is
/// another exception, or outside of a cycle.
bool mask_float_exceptions([[maybe_unused]] const siginfo_t& info,
                           [[maybe_unused]] void* context) noexcept {
#if defined(__x86_64__)
    Core* const core = Core::current();
    const bool is_float = info.si_code >= FPE_FLTDIV && info.si_code <= FPE_FLTINV;
    if (!core || !core->in_function() || !is_float) return false;
    constexpr unsigned masks = 0x1f80, vector_flags = 0x3f;
    constexpr unsigned short x87_masks = 0x3f, x87_flags = 0x80ff;
    auto& registers = *static_cast<ucontext_t*>(context)->uc_mcontext.fpregs;
    registers.mxcsr = (registers.mxcsr | masks) & ~vector_flags;
    registers.cwd = registers.cwd | x87_masks;
    registers.swd = static_cast<unsigned short>(registers.swd & ~x87_flags);
    core->note_trap();
    install_crash_handler(SIGFPE);
    return true;
#else
    return false;
#endif
}

/// Prints " crashed (Segmentation fault)".
void print_crashed(int signal) noexcept {
    print(" crashed (");
    print(signal_text(signal));
    print(")");
}

/// Prints what was executed by this thread, and the signal that ended it.
void print_place_of_crash(int signal) noexcept {
    const Core* const core = Core::current();
    if (core && core->in_function()) {
        name_function(core, core->current_function());
        print_crashed(signal);
        print(" at cycle ");
        print(core->cycle_number());
        return;
    }
    if (const char* const module = module_of_task()) {
        print(module);
        print(": a task of the module's own");
        return print_crashed(signal);
    }
    print("the program crashed outside of the cycle (");
    print(signal_text(signal));
    print(")");
}

/// Makes outputs safe, prints one line and ends the process by the signal. raise() ends it because
/// SA_RESETHAND has put the default action back. [any], async-signal-safe
void on_signal(int signal, siginfo_t* info, void* context) {
    if (signal == SIGFPE && mask_float_exceptions(*info, context)) return;
    if (in_process_copy) {
        raise(signal);
        return;
    }
    // true: by the terminate handler, or this is a crash while outputs are made safe
    const bool is_reported = reported.exchange(true);
    if (is_reported) {
        raise(signal);
        return;
    }
    ExitObserver::silence();
    make_all_safe();
    print("hal: ");
    print_place_of_crash(signal);
    print("; outputs were set to their safe values; the process ends\n");
    raise(signal);
}

void install_crash_handler(int signal) noexcept {
    struct sigaction action{};
    action.sa_sigaction = on_signal;
    action.sa_flags = SA_RESETHAND | SA_NODEFER | SA_ONSTACK | SA_SIGINFO;
    sigaction(signal, &action, nullptr);
}

// the process of the machines; one that it forks ends without a message
std::atomic<pid_t> machine_process{0};

bool has_machine() noexcept {
    return std::any_of(std::begin(watched), std::end(watched),
                       [](const auto& one) { return one.load() != nullptr; });
}

// What calls: a function in its cycle, a task of a module, a constructor, start or stop of an
// instance, or any other thread.
void name_caller(const Core* in_function, const char* module) noexcept {
    if (in_function) return name_function(in_function, in_function->current_function());
    if (module) {
        print(module);
        return print(": a task of the module's own");
    }
    if (SetupCall::is_mine()) {
        print("'");
        print(SetupCall::now.instance);
        print("' (");
        print(SetupCall::now.component);
        return print(")");
    }
    char name[32] = "";
    pthread_getname_np(pthread_self(), name, sizeof name);
    // a thread of a component or a library has the name of the one that created it
    print("a thread named '");
    print(name);
    print("'");
}

int failure(int status) noexcept { return status != 0 ? status : 1; }

// Static destructors must not run beside threads that use the objects.
void on_exit_of_process(int status, void*) {
    if (!report_end("exit()")) {
        if (reported.load()) {
            end_process(failure(status));
        }
        return;
    }
    if (ftrylockfile(stdout) == 0) {
        fflush_unlocked(stdout);
    }
    end_process(failure(status));
}

void on_quick_exit() {
    if (report_end("quick_exit()")) {
        end_process(1);
    }
}

// A noexcept function let an exception out. The cycle goes on without the thread's functions.
[[noreturn]] void on_terminate() {
    if (Core* const core = Core::current(); core && core->in_function()) {
        if (std::current_exception()) {
            abi::__cxa_end_catch();  // gives the exception's memory back
        }
        std::longjmp(core->recover, 1);
    }
    if (in_process_copy || reported.exchange(true)) {
        std::abort();
    }
    ExitObserver::silence();
    make_all_safe();
    print(
        "hal: an exception outside of the cycle was not caught; outputs were set to their safe "
        "values; the process ends\n");
    std::abort();
}

}  // namespace

bool end_is_reported() noexcept { return reported.load(); }

void continue_in_copy() noexcept {
    machine_process = getpid();
    in_process_copy = false;
}

bool is_machine_process() noexcept { return machine_process.load() == getpid(); }

namespace {

/// Who made a call that ends the process, as far as it is known.
struct EndCaller {
    const Core* function = nullptr;  // whose thread executes a function of the machine
    const char* module = nullptr;    // whose own task it is, outside a function
    bool in_setup = SetupCall::is_mine();
    bool has_machine = hal::has_machine();

    static EndCaller now() noexcept {
        EndCaller caller;
        const Core* const core = Core::current();
        if (core && core->in_function()) {
            caller.function = core;
        } else {
            caller.module = module_of_task();
        }
        return caller;
    }
    bool in_cycle() const noexcept { return function || module; }
    bool is_known() const noexcept { return in_cycle() || has_machine || in_setup; }
};

/// Prints what was called, and when.
void print_call(const EndCaller& caller, const char* call) noexcept {
    const bool guarded = __rtsan_realtime_enter && caller.in_cycle();
    if (guarded) {
        print(" made the call that the real-time guard prints above");
    } else {
        print(" called ");
        print(call);
    }
    if (caller.function) {
        print(guarded ? ", at cycle " : " at cycle ");
        print(caller.function->cycle_number());
    } else if (caller.module) {
        return;
    } else if (caller.in_setup) {
        print(" in ");
        print(SetupCall::now.what);
    } else {
        print(" while the machine runs");
    }
}

}  // namespace

// A machine ends by its own orders.
bool report_end(const char* call, const char* code) noexcept {
    if (!is_machine_process()) return false;
    const EndCaller caller = EndCaller::now();
    if (!caller.is_known() || reported.exchange(true)) return false;
    ExitObserver::silence();
    make_all_safe();
    print("hal: ");
    name_caller(caller.function, caller.module);
    print_call(caller, call);
    print(caller.has_machine ? "; outputs were set to their safe values; the process ends"
                             : "; the process ends");
    print(code);
    print("\n");
    return true;
}

void end_copy() noexcept {
    if (SetupCall::is_mine()) {
        print("hal: '");
        print(SetupCall::now.instance);
        print("' (");
        print(SetupCall::now.component);
        print(") called fork() in ");
        print(SetupCall::now.what);
    } else {
        print("hal: a component called fork()");
    }
    print(
        " and let the copy of the process go on; the copy was ended: it must end or execute a "
        "program [cycle-violation]\n");
    end_process(1);
}

void end_process(int status) noexcept {
    reported = true;
    ExitObserver::silence();
    for (;;) {
        syscall(SYS_exit_group, status);
    }
}

CycleNames names_of(const CycleNow& now) {
    CycleNames names;
    for (const auto& one : watched) {
        const MachineView* const machine = one.load();
        if (!machine) continue;
        const auto of = std::find_if(machine->cores.begin(), machine->cores.end(),
                                     [&](const auto& pair) { return pair.second == now.core; });
        if (of == machine->cores.end()) continue;
        names.thread = of->first->name;
        for (const auto& component : machine->model.components) {
            for (const auto& function : component->functions) {
                if (function->id == now.function) {
                    names.function = "function '" + function->name + "' (" + component->name + ")";
                }
            }
        }
    }
    return names;
}

void watch_for_exits() {
    machine_process = getpid();
    in_process_copy = false;
    contain_process_calls();
    static const bool installed =
        ::on_exit(on_exit_of_process, nullptr) == 0 && std::at_quick_exit(on_quick_exit) == 0;
    (void)installed;
}

void watch_for_crashes(const MachineView& machine) {
    watch_for_exits();
    static const bool installed = [] {
        std::set_terminate(on_terminate);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
        // for the program's own thread, which runs the cycles of a virtual clock; the executor's
        // threads have one each
        alignas(16) static char buffer[1 << 15];
        const stack_t other{.ss_sp = buffer, .ss_flags = 0, .ss_size = sizeof buffer};
        sigaltstack(&other, nullptr);
        for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGSYS, SIGTRAP}) {
            install_crash_handler(signal);
        }
#endif
        return true;
    }();
    (void)installed;
    for (auto& place : watched) {
        const MachineView* empty = nullptr;
        if (place.compare_exchange_strong(empty, &machine)) return;
    }
}

void end_watch_for_crashes(const MachineView& machine) {
    for (auto& place : watched) {
        const MachineView* expected = &machine;
        if (place.compare_exchange_strong(expected, nullptr)) return;
    }
}

}  // namespace hal
