// SPDX-License-Identifier: MIT
// Ends the process when a function of a LinuxCNC module makes one of these calls. In a program with
// the real-time sanitizer only.
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <dlfcn.h>
#include <poll.h>
#include <semaphore.h>
#include <sys/epoll.h>
#include <sys/ioctl.h>
#include <sys/select.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <sys/wait.h>
#include <unistd.h>

extern "C" {
void __rtsan_off();
extern const char __executable_start, etext;  // the linker's
void __rtsan_realtime_enter();
void __rtsan_realtime_exit();
[[gnu::visibility("default")]] void halcyon_guard_module_function(bool runs);
[[gnu::visibility("default")]] void halcyon_guard_module_task(bool runs);
}

namespace {

thread_local bool in_module = false;

void say(const char* text) { (void)!syscall(SYS_write, STDERR_FILENO, text, std::strlen(text)); }

// The program's own calls, by which the sanitizer and the crash handler print, pass.
void stop(const char* call, const void* caller) {
    if (!in_module || (caller >= &__executable_start && caller < &etext)) [[likely]]
        return;
    in_module = false;
    __rtsan_off();  // what runs at the end may allocate
    say("Real-time violation: call of `");
    say(call);
    say("` in a function of a LinuxCNC module\n");
    std::exit(EXIT_FAILURE);
}

// The C library's own function. Found when the program starts, because dlsym() allocates.
template <class F>
F* find(F*& known, const char* name) {
    if (!known) {
        known = reinterpret_cast<F*>(dlsym(RTLD_NEXT, name));
    }
    return known;
}

}  // namespace

void halcyon_guard_module_function(bool runs) { in_module = runs; }
void halcyon_guard_module_task(bool runs) {
    in_module = runs;
    runs ? __rtsan_realtime_enter() : __rtsan_realtime_exit();
}

#define STOPPED(result, name, parameters, arguments)                      \
    namespace {                                                           \
    result(*real_##name) parameters = nullptr;                            \
    [[gnu::constructor]] void find_##name() { find(real_##name, #name); } \
    }                                                                     \
    extern "C" [[gnu::visibility("default")]] result name parameters {    \
        stop(#name, __builtin_return_address(0));                         \
        return find(real_##name, #name) arguments;                        \
    }

STOPPED(ssize_t, read, (int file, void* to, std::size_t bytes), (file, to, bytes))
STOPPED(ssize_t, write, (int file, const void* from, std::size_t bytes), (file, from, bytes))
STOPPED(ssize_t, readv, (int file, const iovec* to, int count), (file, to, count))
STOPPED(ssize_t, writev, (int file, const iovec* from, int count), (file, from, count))
STOPPED(int, poll, (pollfd * files, nfds_t count, int ms), (files, count, ms))
STOPPED(int, ppoll, (pollfd * files, nfds_t count, const timespec* max, const sigset_t* signals),
        (files, count, max, signals))
STOPPED(int, select, (int count, fd_set* reads, fd_set* writes, fd_set* others, timeval* max),
        (count, reads, writes, others, max))
STOPPED(int, epoll_wait, (int file, epoll_event* events, int max, int ms), (file, events, max, ms))
STOPPED(int, recvmmsg, (int file, mmsghdr* to, unsigned count, int flags, timespec* max),
        (file, to, count, flags, max))
STOPPED(int, sendmmsg, (int file, mmsghdr* from, unsigned count, int flags),
        (file, from, count, flags))
STOPPED(int, clock_nanosleep, (clockid_t clock, int flags, const timespec* wanted, timespec* left),
        (clock, flags, wanted, left))
STOPPED(int, sem_wait, (sem_t * semaphore), (semaphore))
STOPPED(pid_t, waitpid, (pid_t process, int* status, int flags), (process, status, flags))
STOPPED(int, fsync, (int file), (file))

extern "C" {

[[gnu::visibility("default")]] int ioctl(int file, unsigned long request, ...) noexcept {
    stop("ioctl", __builtin_return_address(0));
    va_list arguments;
    va_start(arguments, request);
    void* const argument = va_arg(arguments, void*);
    va_end(arguments);
    return static_cast<int>(syscall(SYS_ioctl, file, request, argument));
}
[[gnu::visibility("default")]] int printf(const char* format, ...) {
    stop("printf", __builtin_return_address(0));
    va_list arguments;
    va_start(arguments, format);
    const int length = std::vfprintf(stdout, format, arguments);
    va_end(arguments);
    return length;
}
[[gnu::visibility("default")]] int fprintf(FILE* file, const char* format, ...) {
    stop("fprintf", __builtin_return_address(0));
    va_list arguments;
    va_start(arguments, format);
    const int length = std::vfprintf(file, format, arguments);
    va_end(arguments);
    return length;
}
}
