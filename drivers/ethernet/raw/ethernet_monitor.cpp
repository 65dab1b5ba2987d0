// SPDX-License-Identifier: MIT
#include "ethernet_monitor.hpp"

#include <sys/timerfd.h>

namespace hal::ethernet::rawether {

namespace {

constexpr int look_ms = 200;  // polls the kernel's counter of lost frames

/// Opens a timer that never expires but becomes readable (with ECANCELED) when the clock was set
/// (timerfd_create(2)).
void arm(int timer) {
    itimerspec never{};
    never.it_value.tv_sec = link::clock_ns(CLOCK_REALTIME) / 1'000'000'000 + 1'000'000'000;
    timerfd_settime(timer, TFD_TIMER_ABSTIME | TFD_TIMER_CANCEL_ON_SET, &never, nullptr);
}

}  // namespace

EthernetMonitor::EthernetMonitor(std::string name, const Interface& found, Receiver& receiver,
                                 Sender& sender, RealTime& clock)
    : name_(std::move(name)),
      receiver_(receiver),
      sender_(sender),
      clock_(clock),
      index_(found.index),
      clock_steps_(timerfd_create(CLOCK_REALTIME, TFD_NONBLOCK | TFD_CLOEXEC)) {
    arm(clock_steps_.get());
    sender_.up.store(found.up);
    take(found);
    monitor_.emplace("eth-monitor", look_ms, [this] { look(); }, clock_steps_.get());
}

void EthernetMonitor::look() {
    std::uint64_t expirations = 0;
    if (::read(clock_steps_.get(), &expirations, sizeof expirations) < 0 && errno == ECANCELED) {
        arm(clock_steps_.get());
    }
    clock_.measure();
    Interface now = ask(name_);
    if (now.index != 0 && now.index != index_) {
        if (now.ethernet && receiver_.bind(now.index) && sender_.bind(now.index)) {
            index_ = now.index;
        } else {
            now.up = false;
        }
    }
    now.up = now.up && now.index != 0;
    if (const auto l = receiver_.lost(); l != 0) {
        lost.fetch_add(l, std::memory_order_relaxed);
    }
    take(now);
}

void EthernetMonitor::take(const Interface& now) {
    if (now.mtu != 0) {
        sender_.mtu.store(now.mtu, std::memory_order_relaxed);
    }
    speed.store(now.speed, std::memory_order_relaxed);
    if (now.up == sender_.up.load()) return;
    if (now.up) {
        sender_.forget();
    } else {
        downs.fetch_add(1, std::memory_order_relaxed);
    }
    sender_.up.store(now.up);
}

}  // namespace hal::ethernet::rawether
