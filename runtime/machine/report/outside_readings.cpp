// SPDX-License-Identifier: MIT
#include "machine/report/outside_readings.hpp"

// A sanitizer has these functions itself.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)

void hal::report_outside_readings() noexcept {}

#else

#include <atomic>

#include <sys/socket.h>
#include <sys/uio.h>
#include <unistd.h>

#include "execute/core.hpp"
#include "machine/report/next_function.hpp"

namespace {

constinit hal::NextFunction<ssize_t(int, void*, std::size_t)> next_read{"read"};
constinit hal::NextFunction<ssize_t(int, const iovec*, int)> next_readv{"readv"};
constinit hal::NextFunction<ssize_t(int, void*, std::size_t, int)> next_recv{"recv"};
constinit hal::NextFunction<ssize_t(int, void*, std::size_t, int, sockaddr*, socklen_t*)>
    next_recvfrom{"recvfrom"};
constinit hal::NextFunction<ssize_t(int, msghdr*, int)> next_recvmsg{"recvmsg"};

std::atomic<bool> reports{false};

/// Called before each reading.
void note_reading() noexcept {
    if (!reports.load(std::memory_order_relaxed)) return;
    hal::Core* const core = hal::Core::current();
    if (core && core->in_function()) {
        core->note_outside_reading();
    }
}

}  // namespace

void hal::report_outside_readings() noexcept {
    (void)*next_read;
    (void)*next_readv;
    (void)*next_recv;
    (void)*next_recvfrom;
    (void)*next_recvmsg;
    reports.store(true);
}

// Weak: test programs have some of their own.
extern "C" {

[[gnu::weak, gnu::visibility("default")]] ssize_t read(int file, void* to, std::size_t bytes) {
    note_reading();
    return (*next_read)(file, to, bytes);
}

[[gnu::weak, gnu::visibility("default")]] ssize_t readv(int file, const iovec* to, int count) {
    note_reading();
    return (*next_readv)(file, to, count);
}

[[gnu::weak, gnu::visibility("default")]] ssize_t recv(int socket, void* to, std::size_t bytes,
                                                       int flags) {
    note_reading();
    return (*next_recv)(socket, to, bytes, flags);
}

[[gnu::weak, gnu::visibility("default")]] ssize_t recvfrom(int socket, void* to, std::size_t bytes,
                                                           int flags, sockaddr* address,
                                                           socklen_t* size) {
    note_reading();
    return (*next_recvfrom)(socket, to, bytes, flags, address, size);
}

[[gnu::weak, gnu::visibility("default")]] ssize_t recvmsg(int socket, msghdr* to, int flags) {
    note_reading();
    return (*next_recvmsg)(socket, to, flags);
}

}  // extern "C"

#endif
