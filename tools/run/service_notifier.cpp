// SPDX-License-Identifier: MIT
#include "run/service_notifier.hpp"
#include "execute/process_setup.hpp"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <fcntl.h>
#include <fmt/core.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/un.h>
#include <unistd.h>

namespace hal::tools {

namespace {

std::string take(const char* name) {
    const char* const value = std::getenv(name);
    std::string text = value ? value : "";
    ::unsetenv(name);
    return text;
}

std::int64_t now_us() {
    timespec time{};
    ::clock_gettime(CLOCK_MONOTONIC, &time);
    return time.tv_sec * 1'000'000 + time.tv_nsec / 1000;
}

}  // namespace

ServiceNotifier::ServiceNotifier() : socket_(take("NOTIFY_SOCKET")) {
    if (socket_.size() >= sizeof sockaddr_un{}.sun_path ||
        (!socket_.empty() && socket_[0] != '/' && socket_[0] != '@')) {
        socket_.clear();
    }
    const std::string timeout = take("WATCHDOG_USEC");
    const std::string process = take("WATCHDOG_PID");
    if (process.empty() || std::strtol(process.c_str(), nullptr, 10) == ::getpid()) {
        watchdog_us_ = std::strtoll(timeout.c_str(), nullptr, 10);
    }
}

ServiceNotifier::~ServiceNotifier() {
    if (!forwarder_.joinable()) return;
    // The supervisor of a hung thread may still have the pipe open: its end alone would not end the
    // forwarder.
    [[maybe_unused]] const auto written = ::write(pipe_, "V", 1);
    ::close(pipe_);
    forwarder_.join();
}

void ServiceNotifier::send(const std::string& lines) const {
    if (socket_.empty()) return;
    sockaddr_un to{};
    to.sun_family = AF_UNIX;
    std::memcpy(to.sun_path, socket_.data(), socket_.size());
    if (socket_[0] == '@') {
        to.sun_path[0] = '\0';  // abstract
    }
    const int descriptor = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (descriptor < 0) return;
    // a service manager that does not read delays a machine no longer than that
    const timeval limit{1, 0};
    ::setsockopt(descriptor, SOL_SOCKET, SO_SNDTIMEO, &limit, sizeof limit);
    const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + socket_.size());
    [[maybe_unused]] const auto sent =
        ::sendto(descriptor, lines.data(), lines.size(), MSG_NOSIGNAL,
                 reinterpret_cast<const sockaddr*>(&to), size);
    ::close(descriptor);
}

std::string ServiceNotifier::watchdog_device(std::string& problem) {
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0) {
        problem = fmt::format("cannot create a pipe for the watchdog of the service manager: {}",
                              std::strerror(errno));
        return {};
    }
    pipe_ = ends[1];
    forwarder_ = std::thread([this, from = ends[0]] { forward(from); });
    return fmt::format("/proc/self/fd/{}", pipe_);
}

void ServiceNotifier::forward(int from) const {
    release_unused_stack();
    std::int64_t sent_us = 0;
    char signs[64];
    for (ssize_t count = 0;
         (count = ::read(from, signs, sizeof signs)) > 0 || (count < 0 && errno == EINTR);) {
        if (count > 0 && std::memchr(signs, 'V', static_cast<std::size_t>(count))) break;
        const std::int64_t now = now_us();
        if (count <= 0 || (sent_us != 0 && now - sent_us < watchdog_us_ / 4)) continue;
        sent_us = now;
        send("WATCHDOG=1");
    }
    ::close(from);
}

void ServiceNotifier::ready(const std::string& status) { send("READY=1\nSTATUS=" + status); }

void ServiceNotifier::stopping() { send("STOPPING=1"); }

}  // namespace hal::tools
