// SPDX-License-Identifier: MIT
#include "base/poll_all.hpp"

#include <algorithm>
#include <cerrno>

#include <sys/select.h>

namespace hal {
namespace {

bool fits(int descriptor) noexcept { return descriptor >= 0 && descriptor < FD_SETSIZE; }

/// select() does not look at the limit. It takes descriptors below 1024.
int select_all(std::span<pollfd> polled, const timespec* timeout) noexcept {
    fd_set readable;
    fd_set writable;
    FD_ZERO(&readable);
    FD_ZERO(&writable);
    int end = 0;
    for (const pollfd& entry : polled) {
        if (!fits(entry.fd)) continue;
        if (entry.events & POLLIN) {
            FD_SET(entry.fd, &readable);
        }
        if (entry.events & POLLOUT) {
            FD_SET(entry.fd, &writable);
        }
        end = std::max(end, entry.fd + 1);
    }
    const int ready = pselect(end, &readable, &writable, nullptr, timeout, nullptr);
    for (pollfd& entry : polled) {
        entry.revents = 0;
        if (ready <= 0 || !fits(entry.fd)) continue;
        if (FD_ISSET(entry.fd, &readable)) {
            entry.revents |= POLLIN;
        }
        if (FD_ISSET(entry.fd, &writable)) {
            entry.revents |= POLLOUT;
        }
    }
    return ready;
}

}  // namespace

int poll_all(std::span<pollfd> polled, const timespec* timeout) noexcept {
    const int ready = ppoll(polled.data(), polled.size(), timeout, nullptr);
    if (ready >= 0 || errno != EINVAL) return ready;
    return select_all(polled, timeout);
}

}  // namespace hal
