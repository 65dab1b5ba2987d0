// SPDX-License-Identifier: MIT
#include "cli/signals.hpp"

#include <algorithm>
#include <array>
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

#include "base/own_descriptors.hpp"
#include "base/poll_all.hpp"
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

StopRequest::StopRequest(Handles what) {
    event_ = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    if (event_ < 0) {
        throw std::system_error(errno, std::generic_category(), "cannot wait for a request");
    }
    list_descriptor(event_, "the request to stop");
    if (what == Handles::signals) {
        begin();
    }
}

void StopRequest::begin() {
    ignore_unexpected();
    const sigset_t set = ending_signals();
    ::pthread_sigmask(SIG_BLOCK, &set, nullptr);
    done_ = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    caught_ = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    signals_ = ::signalfd(-1, &set, SFD_CLOEXEC | SFD_NONBLOCK);
    if (done_ < 0 || signals_ < 0 || caught_ < 0) {
        throw std::system_error(errno, std::generic_category(), "cannot wait for signals");
    }
    list_descriptor(done_, "the end of the signal thread");
    list_descriptor(signals_, "the signals");
    list_descriptor(caught_, "the signals of unblocked threads");
    handle_unblocked(true);
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
    handle_unblocked(false);
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
    for (const int descriptor : {event_, done_, signals_, caught_}) {
        close_own(descriptor);
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
        receive_signal(static_cast<int>(info.ssi_signo));
    }
    eventfd_t ignored;
    if (::eventfd_read(caught_, &ignored) == 0) {
        receive_signal(unblocked_.load());
    }
}

void StopRequest::receive_signal(int number) {
    if (number != SIGINT || !spare_) {
        int none = 0;
        signal_.compare_exchange_strong(none, number);
        request();
    }
    if (told_) {
        told_();
    }
}

namespace {

std::atomic<StopRequest*> handling{nullptr};  // there is one at a time
std::array<struct sigaction, NSIG> before_handling;

}  // namespace

void StopRequest::on_unblocked(int number) {
    const int error = errno;
    if (StopRequest* const request = handling.load()) {
        request->unblocked_ = number;
        ::eventfd_write(request->caught_, 1);
    }
    errno = error;
}

void StopRequest::handle_unblocked(bool on) {
    struct sigaction action{};
    action.sa_handler = on_unblocked;
    action.sa_flags = SA_RESTART;
    const sigset_t set = ending_signals();
    for (std::size_t i = 1; i < before_handling.size(); ++i) {
        const int number = static_cast<int>(i);
        if (::sigismember(&set, number) != 1) continue;
        if (on) {
            ::sigaction(number, &action, &before_handling[i]);
        } else {
            ::sigaction(number, &before_handling[i], nullptr);
        }
    }
    handling = on ? this : nullptr;
}

void StopRequest::spare(bool on) {
    const std::lock_guard lock(mutex_);
    receive_signals();
    spare_ = on;
}

void StopRequest::serve() {
    release_unused_stack();
    for (;;) {
        pollfd all[3] = {{signals_, POLLIN, 0}, {done_, POLLIN, 0}, {caught_, POLLIN, 0}};
        if (poll_all(all, nullptr) < 0) continue;
        if (all[1].revents != 0) return;
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
        pollfd event[] = {{event_, POLLIN, 0}};
        poll_all(event, ns < 0 ? nullptr : &timeout);
    }
    return requested();
}

}  // namespace hal::tools
