// SPDX-License-Identifier: MIT
// Wrappers of the operating system for drivers: an owned descriptor, clocks, waiting for a
// descriptor.
#pragma once

#include <poll.h>
#include <time.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <string>
#include <utility>

namespace hal::link {

/// Owns a file descriptor and closes it.
class Descriptor {
public:
    Descriptor() = default;
    explicit Descriptor(int fd) noexcept : fd_(fd) {}
    Descriptor(Descriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
    Descriptor& operator=(Descriptor&& other) noexcept {
        std::swap(fd_, other.fd_);
        return *this;
    }
    ~Descriptor() {
        if (fd_ >= 0) {
            ::close(fd_);
        }
    }
    int get() const noexcept { return fd_; }
    explicit operator bool() const noexcept { return fd_ >= 0; }

private:
    int fd_ = -1;
};

/// Returns the time of a clock in ns.
inline std::int64_t clock_ns(clockid_t clock) noexcept {
    timespec t{};
    clock_gettime(clock, &t);
    return t.tv_sec * 1'000'000'000LL + t.tv_nsec;
}
/// Returns the time of CLOCK_MONOTONIC in ns.
inline std::int64_t monotonic_ns() noexcept { return clock_ns(CLOCK_MONOTONIC); }
/// Returns the offset to add to a time of CLOCK_REALTIME.
inline std::int64_t real_to_monotonic_ns() noexcept {
    return monotonic_ns() - clock_ns(CLOCK_REALTIME);
}

/// Converts a time in ns for calls of the operating system. `long` has 32 bits on 32-bit machines,
/// which the ns of a second fit into.
constexpr timespec to_timespec(std::int64_t ns) noexcept {
    timespec time{};
    time.tv_sec = static_cast<time_t>(ns / 1'000'000'000);
    time.tv_nsec = static_cast<long>(ns % 1'000'000'000);
    return time;
}

/// Waits until the descriptor is readable, or its peer is gone. Returns false on timeout. [setup]
inline bool readable_within(int fd, std::int64_t at_most_ns) noexcept {
    pollfd p{fd, POLLIN, 0};
    const timespec limit = to_timespec(at_most_ns > 0 ? at_most_ns : 0);
    return ppoll(&p, 1, &limit, nullptr) > 0;
}

/// Returns the text of an error number.
inline std::string reason(int error = errno) { return std::strerror(error); }

}  // namespace hal::link
