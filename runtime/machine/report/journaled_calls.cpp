// SPDX-License-Identifier: MIT
#include "machine/report/journaled_calls.hpp"

#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <ctime>

#include <cstdarg>
#include <fcntl.h>
#include <pthread.h>
#include <sys/time.h>

#include "execute/core.hpp"
#include "machine/load/setup_call.hpp"
#include "machine/report/next_function.hpp"

namespace hal {
namespace {

std::atomic<std::size_t> created_threads{0};
std::atomic<SetupReader*> setup_reader{nullptr};  // written in setup

}  // namespace

void set_setup_reader(SetupReader* reader) noexcept { setup_reader.store(reader); }

std::size_t threads_of_components() noexcept { return created_threads.load(); }

}  // namespace hal

// A sanitizer has these functions itself.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)

void hal::prepare_journaled_calls() noexcept {}
std::int64_t hal::journaled_reading(std::int64_t value) noexcept { return value; }

#else

namespace {

constinit hal::NextFunction<int(clockid_t, timespec*)> next_clock_gettime{"clock_gettime"};
constinit hal::NextFunction<int(timeval*, void*)> next_gettimeofday{"gettimeofday"};
constinit hal::NextFunction<time_t(time_t*)> next_time{"time"};
constinit hal::NextFunction<int(const char*, int, ...)> next_open{"open"};
constinit hal::NextFunction<int()> next_rand{"rand"};
constinit hal::NextFunction<long()> next_random{"random"};
constinit hal::NextFunction<int(pthread_t*, const pthread_attr_t*, void* (*)(void*), void*)>
    next_pthread_create{"pthread_create"};

constexpr std::int64_t second_ns = 1'000'000'000;

/// Returns who gets the calls of the calling thread; nullptr: it makes no setup call, or nobody.
hal::SetupReader* reader_of_call() noexcept {
    hal::SetupReader* const reader = hal::setup_reader.load(std::memory_order_acquire);
    return reader && hal::SetupCall::is_mine() ? reader : nullptr;
}

bool is_journaled() noexcept { return hal::Core::current() || reader_of_call(); }

}  // namespace

std::int64_t hal::journaled_reading(std::int64_t value) noexcept {
    Core* const core = hal::Core::current();
    if (!core) {
        SetupReader* const reader = reader_of_call();
        return reader ? reader->reading(value) : value;
    }
    return static_cast<std::int64_t>(core->note_reading(static_cast<std::uint64_t>(value)));
}

void hal::prepare_journaled_calls() noexcept {
    (void)*next_clock_gettime;
    (void)*next_gettimeofday;
    (void)*next_time;
    (void)*next_open;
    (void)*next_rand;
    (void)*next_random;
    (void)*next_pthread_create;
}

// Weak: test programs have some of their own.
extern "C" {

[[gnu::weak, gnu::visibility("default")]] int clock_gettime(clockid_t clock,
                                                            timespec* to) noexcept {
    const int result = (*next_clock_gettime)(clock, to);
    if (result != 0 || !is_journaled()) return result;
    *to = hal::to_timespec(
        hal::journaled_reading(std::int64_t{to->tv_sec} * second_ns + to->tv_nsec));
    return result;
}

[[gnu::weak, gnu::visibility("default")]] int gettimeofday(timeval* to, void* zone) noexcept {
    const int result = (*next_gettimeofday)(to, zone);
    if (result != 0 || !is_journaled()) return result;
    constexpr std::int64_t second_us = 1'000'000;
    const std::int64_t us =
        hal::journaled_reading(std::int64_t{to->tv_sec} * second_us + to->tv_usec);
    to->tv_sec = static_cast<time_t>(us / second_us);
    to->tv_usec = static_cast<suseconds_t>(us % second_us);
    return result;
}

[[gnu::weak, gnu::visibility("default")]] time_t time(time_t* to) noexcept {
    const auto now = static_cast<time_t>(
        hal::journaled_reading(static_cast<std::int64_t>((*next_time)(nullptr))));
    if (to) {
        *to = now;
    }
    return now;
}

[[gnu::weak, gnu::visibility("default")]] int open(const char* path, int flags, ...) {
    mode_t mode = 0;
    if ((flags & O_CREAT) != 0 || (flags & O_TMPFILE) == O_TMPFILE) {
        va_list rest;
        va_start(rest, flags);
        mode = va_arg(rest, mode_t);
        va_end(rest);
    }
    hal::SetupReader* const reader = (flags & O_ACCMODE) == O_RDONLY ? reader_of_call() : nullptr;
    if (!reader) return (*next_open)(path, flags, mode);
    const auto open_now = [](const char* name, int how) { return (*next_open)(name, how); };
    return reader->opened(path, open_now, flags);
}

[[gnu::weak, gnu::visibility("default")]] int rand() noexcept {
    return static_cast<int>(hal::journaled_reading((*next_rand)()));
}

[[gnu::weak, gnu::visibility("default")]] long random() noexcept {
    return static_cast<long>(hal::journaled_reading((*next_random)()));
}

[[gnu::weak, gnu::visibility("default")]] int pthread_create(pthread_t* thread,
                                                             const pthread_attr_t* attributes,
                                                             void* (*start)(void*),
                                                             void* argument) noexcept {
    if (hal::SetupCall::is_mine()) {
        ++hal::created_threads;
    }
    return (*next_pthread_create)(thread, attributes, start, argument);
}

}  // extern "C"

#endif
