// SPDX-License-Identifier: MIT
#include "machine/report/process_calls.hpp"

#include <atomic>
#include <cerrno>
#include <csetjmp>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <cstring>

#include <pthread.h>
#include <sched.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "base/own_descriptors.hpp"
#include "base/process_copy.hpp"
#include "execute/core.hpp"
#include "machine/load/foreign_code.hpp"
#include "machine/load/setup_call.hpp"
#include "machine/report/crash.hpp"
#include "machine/report/next_function.hpp"

namespace hal {
namespace {

Core* core_in_function() noexcept {
    Core* const core = Core::current();
    return core && core->in_function() ? core : nullptr;
}

void note_fork() noexcept {
    if (Core* const core = core_in_function()) {
        core->note_fork();
    }
}

// A function that forks in its cycle gets no copy. A constructor or a thread of a component may
// start a program by fork and exec: its copy lives, without what makes it a machine.
void become_copy() noexcept {
    if (core_in_function()) {
        for (;;) {
            syscall(SYS_exit_group, 1);
        }
    }
    in_process_copy = true;
    drop_descriptors_of_parent();
}

}  // namespace

void contain_process_calls() noexcept {
    static const bool installed = pthread_atfork(nullptr, note_fork, become_copy) == 0;
    (void)installed;
}

void ForeignCode::over() noexcept {
    if (in_process_copy && !in_copy_) {
        end_copy();
    }
    modes_.set();
}

}  // namespace hal

// A sanitizer has these functions itself.
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)

namespace {

template <class Function>
using Next = hal::NextFunction<Function>;

constinit Next<long(long, ...)> next_syscall{"syscall"};
constinit Next<int(int)> next_close{"close"};
constinit Next<int(int, int)> next_dup2{"dup2"};
constinit Next<int(int, int, int)> next_dup3{"dup3"};
constinit Next<int(unsigned, unsigned, int)> next_close_range{"close_range"};
constinit Next<void(int)> next_closefrom{"closefrom"};
using Exec = int(const char*, char* const*, char* const*);
constinit Next<Exec> next_execve{"execve"};
constinit Next<Exec> next_execvpe{"execvpe"};
constinit Next<int(int, char* const*, char* const*)> next_fexecve{"fexecve"};
constinit Next<int(int, const char*, char* const*, char* const*, int)> next_execveat{"execveat"};
constinit Next<pid_t()> next_fork{"_Fork"};
constinit Next<void(void*)> next_pthread_exit{"pthread_exit"};

int failure(int status) noexcept { return status != 0 ? status : 1; }

[[noreturn]] void end_directly(int status, const char* call) noexcept {
    if (hal::report_end(call)) {
        hal::end_process(failure(status));
    }
    for (;;) {
        syscall(SYS_exit_group, status);
    }
}

/// Descriptors first..last are about to be closed or replaced. Ends the process with status 1 when
/// the runtime needs one of them; returns false when that is reported already: then they stay.
bool may_close(const char* call, unsigned first, unsigned last) noexcept {
    const int number = hal::own_descriptor_within(first, last);
    if (number < 0 || !hal::is_machine_process()) return true;
    // The watch reports a lost descriptor. Its number may belong to another file, which is closed
    // by its owner.
    const bool in_component = hal::core_in_function() != nullptr || hal::SetupCall::is_mine();
    if (!in_component && !hal::is_intact(number)) return true;
    char text[160];
    std::snprintf(text, sizeof text, "%s for descriptor %d, %s of the runtime,", call, number,
                  hal::own_descriptor(number));
    if (hal::report_end(text, " [cycle-violation]")) {
        hal::end_process(1);
    }
    errno = EBADF;
    return false;
}

bool may_close(const char* call, int descriptor) noexcept {
    return descriptor < 0 ||
           may_close(call, static_cast<unsigned>(descriptor), static_cast<unsigned>(descriptor));
}

/// In a function of a cycle, or in a constructor, start or stop of an instance: does not return.
void end_thread_of_component() noexcept {
    if (hal::Core* const core = hal::core_in_function()) {
        std::longjmp(core->recover, hal::Core::ended_thread);
    }
    if (hal::SetupCall::is_mine() && hal::report_end("pthread_exit()", " [cycle-violation]")) {
        hal::end_process(1);
    }
}

/// A component would replace the machine by another program: outputs would stay as they are.
void end_before_exec(const char* call) noexcept {
    if (!hal::is_machine_process()) return;
    // an end that was reported already makes outputs safe in another thread
    if (hal::report_end(call, " [cycle-violation]") || hal::end_is_reported()) {
        hal::end_process(1);
    }
}

/// Collects the arguments of execl() and its relatives, up to the null pointer. Returns false when
/// there are too many.
constexpr std::size_t max_exec_arguments = 1024;
bool collect(const char* first, va_list* list,
             char* (&arguments)[max_exec_arguments]) noexcept {
    std::size_t count = 0;
    for (const char* one = first; one != nullptr; one = va_arg(*list, const char*)) {
        if (count + 1 == max_exec_arguments) {
            errno = E2BIG;
            return false;
        }
        arguments[count++] = const_cast<char*>(one);
    }
    arguments[count] = nullptr;
    return true;
}

bool copies_process(long number, const long* argument) noexcept {
#ifdef SYS_fork
    if (number == SYS_fork) return true;
#endif
#ifdef SYS_clone3
    if (number == SYS_clone3) {
        // its first member is the flags
        const auto* const flags = reinterpret_cast<const std::uint64_t*>(argument[0]);
        return (*flags & CLONE_VM) == 0;
    }
#endif
    return number == SYS_clone && (argument[0] & CLONE_VM) == 0;
}

/// Returns false when the call must fail with errno.
bool may_call(long number, long* argument) noexcept {
    const auto descriptor = [argument](int i) noexcept { return static_cast<int>(argument[i]); };
    switch (number) {
    case SYS_exit_group:
        if (hal::report_end("the system call exit_group")) {
            argument[0] = failure(static_cast<int>(argument[0]));
        }
        return true;
    case SYS_exit: end_thread_of_component(); return true;
    case SYS_execve: end_before_exec("the system call execve"); return true;
#ifdef SYS_execveat
    case SYS_execveat: end_before_exec("the system call execveat"); return true;
#endif
    case SYS_close: return may_close("the system call close", descriptor(0));
    case SYS_dup3: return may_close("the system call dup3", descriptor(1));
#ifdef SYS_dup2
    case SYS_dup2:
        return argument[0] == argument[1] || may_close("the system call dup2", descriptor(1));
#endif
#ifdef SYS_close_range
    case SYS_close_range:
        return argument[2] != 0 || may_close("the system call close_range",
                                             static_cast<unsigned>(argument[0]),
                                             static_cast<unsigned>(argument[1]));
#endif
    default: return true;
    }
}

}  // namespace

extern "C" {

[[noreturn, gnu::visibility("default")]] void _exit(int status) { end_directly(status, "_exit()"); }
[[noreturn, gnu::visibility("default")]] void _Exit(int status) noexcept {
    end_directly(status, "_Exit()");
}

[[gnu::visibility("default")]] long syscall(long number, ...) noexcept {
    va_list list;
    va_start(list, number);
    long argument[6];
    for (long& one : argument) {
        one = va_arg(list, long);
    }
    va_end(list);
    if (!may_call(number, argument)) return -1;
    const long result = (*next_syscall)(number, argument[0], argument[1], argument[2], argument[3],
                                        argument[4], argument[5]);
    if (copies_process(number, argument)) [[unlikely]] {
        if (result == 0) {
            hal::become_copy();
        } else if (result > 0) {
            hal::note_fork();
        }
    }
    return result;
}

// Weak: the real-time guard of the tests has its own.
[[gnu::weak, gnu::visibility("default")]] int close(int descriptor) {
    return may_close("close()", descriptor) ? (*next_close)(descriptor) : -1;
}

[[gnu::visibility("default")]] int dup2(int from, int to) noexcept {
    return from == to || may_close("dup2()", to) ? (*next_dup2)(from, to) : -1;
}

[[gnu::visibility("default")]] int dup3(int from, int to, int flags) noexcept {
    return may_close("dup3()", to) ? (*next_dup3)(from, to, flags) : -1;
}

[[gnu::visibility("default")]] int close_range(unsigned first, unsigned last, int flags) noexcept {
    if (flags == 0 && !may_close("close_range()", first, last)) return -1;
    return (*next_close_range)(first, last, flags);
}

[[gnu::visibility("default")]] void closefrom(int first) noexcept {
    if (may_close("closefrom()", first < 0 ? 0U : static_cast<unsigned>(first), ~0U)) {
        (*next_closefrom)(first);
    }
}

[[gnu::visibility("default")]] int execve(const char* path, char* const* arguments,
                                          char* const* variables) noexcept {
    end_before_exec("execve()");
    return (*next_execve)(path, arguments, variables);
}

[[gnu::visibility("default")]] int execv(const char* path, char* const* arguments) noexcept {
    end_before_exec("execv()");
    return (*next_execve)(path, arguments, environ);
}

[[gnu::visibility("default")]] int execvpe(const char* file, char* const* arguments,
                                           char* const* variables) noexcept {
    end_before_exec("execvpe()");
    return (*next_execvpe)(file, arguments, variables);
}

[[gnu::visibility("default")]] int execvp(const char* file, char* const* arguments) noexcept {
    end_before_exec("execvp()");
    return (*next_execvpe)(file, arguments, environ);
}

[[gnu::visibility("default")]] int fexecve(int file, char* const* arguments,
                                           char* const* variables) noexcept {
    end_before_exec("fexecve()");
    return (*next_fexecve)(file, arguments, variables);
}

[[gnu::visibility("default")]] int execveat(int folder, const char* path, char* const* arguments,
                                            char* const* variables, int flags) noexcept {
    end_before_exec("execveat()");
    return (*next_execveat)(folder, path, arguments, variables, flags);
}

[[gnu::visibility("default")]] int execl(const char* path, const char* first, ...) noexcept {
    end_before_exec("execl()");
    char* arguments[max_exec_arguments];
    va_list list;
    va_start(list, first);
    const bool fits = collect(first, &list, arguments);
    va_end(list);
    return fits ? (*next_execve)(path, arguments, environ) : -1;
}

[[gnu::visibility("default")]] int execlp(const char* file, const char* first, ...) noexcept {
    end_before_exec("execlp()");
    char* arguments[max_exec_arguments];
    va_list list;
    va_start(list, first);
    const bool fits = collect(first, &list, arguments);
    va_end(list);
    return fits ? (*next_execvpe)(file, arguments, environ) : -1;
}

[[gnu::visibility("default")]] int execle(const char* path, const char* first, ...) noexcept {
    end_before_exec("execle()");
    char* arguments[max_exec_arguments];
    va_list list;
    va_start(list, first);
    const bool fits = collect(first, &list, arguments);
    char* const* const variables = fits ? va_arg(list, char* const*) : nullptr;
    va_end(list);
    return fits ? (*next_execve)(path, arguments, variables) : -1;
}

[[gnu::visibility("default")]] pid_t _Fork() noexcept {
    const pid_t child = (*next_fork)();
    if (child == 0) {
        hal::become_copy();
    } else if (child > 0) {
        hal::note_fork();
    }
    return child;
}

// The child of the C library's vfork() runs in the memory of the machine.
[[gnu::visibility("default")]] pid_t vfork() noexcept { return fork(); }

[[noreturn, gnu::visibility("default")]] void pthread_exit(void* value) {
    end_thread_of_component();
    (*next_pthread_exit)(value);
    __builtin_unreachable();
}

}  // extern "C"

#endif
