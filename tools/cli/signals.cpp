// SPDX-License-Identifier: MIT
#include "cli/signals.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <fmt/core.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/signalfd.h>
#include <system_error>
#include <unistd.h>
#include <utility>

#include "execute/process_setup.hpp"
#include "hal/clock.hpp"

namespace hal::tools {

namespace {

sigset_t ending_signals() {
    sigset_t set;
    sigemptyset(&set);
    for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGXCPU, SIGPWR}) {
        sigaddset(&set, number);
    }
    return set;
}

/// Nothing here uses these, and their default action ends the process. Programs that are started
/// get the default action back.
void ignore_unexpected() {
    for (const int number :
         {SIGPIPE, SIGUSR1, SIGUSR2, SIGALRM, SIGVTALRM, SIGPROF, SIGIO, SIGSTKFLT, SIGXFSZ}) {
        ::signal(number, SIG_IGN);
    }
    for (int number = SIGRTMIN; number <= SIGRTMAX; ++number) {
        ::signal(number, SIG_IGN);
    }
}

}  // namespace

std::string end_description(int status) {
    if (status == 0) return "ended";
    if (status <= 128) {
        return fmt::format("ended with exit status {}", status);
    }
    const char* const name = ::sigabbrev_np(status - 128);
    return name ? fmt::format("was terminated by SIG{}", name)
                : fmt::format("was terminated by signal {}", status - 128);
}

StopRequest::StopRequest() {
    ignore_unexpected();
    const sigset_t set = ending_signals();
    ::pthread_sigmask(SIG_BLOCK, &set, nullptr);
    event_ = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    done_ = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    signals_ = ::signalfd(-1, &set, SFD_CLOEXEC | SFD_NONBLOCK);
    if (event_ < 0 || done_ < 0 || signals_ < 0) {
        throw std::system_error(errno, std::generic_category(), "cannot wait for signals");
    }
    thread_ = std::thread([this] { serve(); });
}

void StopRequest::when_signalled(std::function<void()> told) {
    const std::lock_guard lock(mutex_);
    told_ = std::move(told);
    if (signal() != 0 && told_) {
        told_();
    }
}

void StopRequest::release() {
    if (!thread_.joinable()) return;
    const std::uint64_t one = 1;
    [[maybe_unused]] const ssize_t n = ::write(done_, &one, sizeof one);
    thread_.join();
    signalfd_siginfo info{};
    // a second Ctrl-C does not skip the clean-up
    while (::read(signals_, &info, sizeof info) == sizeof info) {
    }
    sigset_t impatient;
    sigemptyset(&impatient);
    sigaddset(&impatient, SIGINT);
    ::pthread_sigmask(SIG_UNBLOCK, &impatient, nullptr);
}

StopRequest::~StopRequest() {
    release();
    for (const int descriptor : {event_, done_, signals_}) {
        ::close(descriptor);
    }
}

void StopRequest::request() noexcept {
    requested_.store(true, std::memory_order_release);
    const std::uint64_t one = 1;
    // an eventfd can only be full, and then it is readable
    [[maybe_unused]] const ssize_t n = ::write(event_, &one, sizeof one);
}

void StopRequest::receive_signals() {
    signalfd_siginfo info{};
    while (::read(signals_, &info, sizeof info) == sizeof info) {
        if (!(info.ssi_signo == SIGINT && spare_)) {
            int none = 0;
            signal_.compare_exchange_strong(none, static_cast<int>(info.ssi_signo));
            request();
        }
        if (told_) {
            told_();
        }
    }
}

void StopRequest::spare(bool on) {
    const std::lock_guard lock(mutex_);
    receive_signals();
    spare_ = on;
}

void StopRequest::serve() {
    release_unused_stack();
    for (;;) {
        pollfd both[2] = {{signals_, POLLIN, 0}, {done_, POLLIN, 0}};
        if (::poll(both, 2, -1) < 0) continue;
        if (both[1].revents != 0) return;
        const std::lock_guard lock(mutex_);
        receive_signals();
    }
}

bool StopRequest::wait_ns(std::int64_t ns) const {
    using namespace std::chrono;
    const auto end = steady_clock::now() + nanoseconds(std::max<std::int64_t>(ns, 0));
    while (!requested()) {
        const std::int64_t left = ns < 0 ? 0 : nanoseconds(end - steady_clock::now()).count();
        if (ns >= 0 && left <= 0) break;
        const timespec timeout = to_timespec(left);
        pollfd event{event_, POLLIN, 0};
        ::ppoll(&event, 1, ns < 0 ? nullptr : &timeout, nullptr);
    }
    return requested();
}

}  // namespace hal::tools
