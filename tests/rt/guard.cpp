// SPDX-License-Identifier: MIT
// Stands before the C library for this program and the plugins it loads. The executor reports the
// beginning and end of a cycle by the two functions that the real-time sanitizer defines when it is
// there.
#include "rt/guard.hpp"

#if !defined(HALCYON_RT_GUARD) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)

#include <cerrno>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <dlfcn.h>
#include <poll.h>
#include <pthread.h>
#include <semaphore.h>
#include <sys/socket.h>
#include <unistd.h>

namespace {

thread_local int open_cycles = 0;

void check(const char* call) noexcept {
    if (open_cycles == 0) [[likely]]
        return;
    open_cycles = 0;
    char line[160];
    const int length = std::snprintf(line, sizeof line, "real-time guard: %s in a cycle\n", call);
    static const auto print =
        reinterpret_cast<ssize_t (*)(int, const void*, std::size_t)>(dlsym(RTLD_NEXT, "write"));
    print(STDERR_FILENO, line, static_cast<std::size_t>(length));
    std::abort();
}

// The C library's own function of a name.
template <class F>
F* next(const char* name) noexcept {
    return reinterpret_cast<F*>(dlsym(RTLD_NEXT, name));
}

}  // namespace

#define GUARDED(result, name, parameters, arguments)              \
    [[gnu::visibility("default")]] result name parameters {       \
        check(#name);                                             \
        static auto* const real = next<result parameters>(#name); \
        return real arguments;                                    \
    }

extern "C" {

void __rtsan_realtime_enter() { ++open_cycles; }
void __rtsan_realtime_exit() {
    if (open_cycles > 0) {
        --open_cycles;
    }
}

// dlsym() allocates, so these four go straight to glibc's second names
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
void __libc_free(void*);

[[gnu::visibility("default")]] void* malloc(std::size_t bytes) {
    check("malloc");
    return __libc_malloc(bytes);
}
[[gnu::visibility("default")]] void* calloc(std::size_t count, std::size_t bytes) {
    check("calloc");
    return __libc_calloc(count, bytes);
}
[[gnu::visibility("default")]] void* realloc(void* memory, std::size_t bytes) {
    check("realloc");
    return __libc_realloc(memory, bytes);
}
[[gnu::visibility("default")]] void* aligned_alloc(std::size_t align, std::size_t bytes) {
    check("aligned_alloc");
    return __libc_memalign(align, bytes);
}
[[gnu::visibility("default")]] void* memalign(std::size_t align, std::size_t bytes) {
    check("memalign");
    return __libc_memalign(align, bytes);
}
[[gnu::visibility("default")]] int posix_memalign(void** memory, std::size_t align,
                                                  std::size_t bytes) {
    check("posix_memalign");
    *memory = __libc_memalign(align, bytes);
    return *memory ? 0 : ENOMEM;
}
[[gnu::visibility("default")]] void free(void* memory) {
    if (memory) {
        check("free");
    }
    __libc_free(memory);
}

GUARDED(int, pthread_mutex_lock, (pthread_mutex_t * mutex), (mutex))
GUARDED(int, pthread_mutex_timedlock, (pthread_mutex_t * mutex, const timespec* until),
        (mutex, until))
GUARDED(int, pthread_rwlock_rdlock, (pthread_rwlock_t * lock), (lock))
GUARDED(int, pthread_rwlock_wrlock, (pthread_rwlock_t * lock), (lock))
GUARDED(int, pthread_cond_wait, (pthread_cond_t * condition, pthread_mutex_t* mutex),
        (condition, mutex))
GUARDED(int, pthread_join, (pthread_t thread, void** result), (thread, result))
GUARDED(int, pthread_create,
        (pthread_t * thread, const pthread_attr_t* attributes, void* (*run)(void*), void* self),
        (thread, attributes, run, self))
GUARDED(int, sem_wait, (sem_t * semaphore), (semaphore))
GUARDED(unsigned, sleep, (unsigned seconds), (seconds))
GUARDED(int, usleep, (useconds_t us), (us))
GUARDED(int, nanosleep, (const timespec* wanted, timespec* left), (wanted, left))
GUARDED(int, clock_nanosleep, (clockid_t clock, int flags, const timespec* wanted, timespec* left),
        (clock, flags, wanted, left))
GUARDED(int, poll, (pollfd * files, nfds_t count, int ms), (files, count, ms))
GUARDED(ssize_t, read, (int file, void* to, std::size_t bytes), (file, to, bytes))
GUARDED(ssize_t, write, (int file, const void* from, std::size_t bytes), (file, from, bytes))
GUARDED(ssize_t, recv, (int file, void* to, std::size_t bytes, int flags), (file, to, bytes, flags))
GUARDED(ssize_t, send, (int file, const void* from, std::size_t bytes, int flags),
        (file, from, bytes, flags))
GUARDED(int, close, (int file), (file))
GUARDED(FILE*, fopen, (const char* path, const char* mode), (path, mode))
GUARDED(int, puts, (const char* text), (text))
GUARDED(std::size_t, fwrite, (const void* from, std::size_t size, std::size_t count, FILE* file),
        (from, size, count, file))
GUARDED(char*, getenv, (const char* name), (name))

}  // extern "C"

#endif
