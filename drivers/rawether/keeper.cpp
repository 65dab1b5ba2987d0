// SPDX-License-Identifier: MIT
#include "rawether/keeper.hpp"

#include <linux/netlink.h>
#include <linux/rtnetlink.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/timerfd.h>

namespace hal::ethernet::rawether {

namespace {

constexpr int look_ms = 200;  // also when nothing was told: the kernel's counter of lost frames is asked for

/// A timer that never ends, but is readable (and says ECANCELED) when the clock was set (timerfd_create(2)).
void arm(int timer) {
    itimerspec never{};
    never.it_value.tv_sec = can::clock_ns(CLOCK_REALTIME) / 1'000'000'000 + 1'000'000'000;
    timerfd_settime(timer, TFD_TIMER_ABSTIME | TFD_TIMER_CANCEL_ON_SET, &never, nullptr);
}

}  // namespace

Keeper::Keeper(std::string name, const Interface& found, Receiver& receiver, Sender& sender, RealTime& clock)
    : name_(std::move(name)), receiver_(receiver), sender_(sender), clock_(clock), index_(found.index),
      events_(::socket(AF_NETLINK, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, NETLINK_ROUTE)),
      clock_steps_(timerfd_create(CLOCK_REALTIME, TFD_NONBLOCK | TFD_CLOEXEC)), wake_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
    sockaddr_nl address{};
    address.nl_family = AF_NETLINK;
    address.nl_groups = RTMGRP_LINK;
    const auto* where = reinterpret_cast<const sockaddr*>(&address);
    if (events_ && ::bind(events_.get(), where, sizeof address) != 0) events_ = {};  // then it looks every now and then only
    arm(clock_steps_.get());
    sender_.up.store(found.up);
    take(found);
    thread_ = std::thread([this] { run(); });
}

Keeper::~Keeper() {
    ending_ = true;
    const std::uint64_t one = 1;
    (void)!::write(wake_.get(), &one, sizeof one);
    thread_.join();
}

void Keeper::run() {
    pthread_setname_np(pthread_self(), "eth-keeper");
    char rubbish[8192];
    while (!ending_) {
        pollfd sources[] = {{wake_.get(), POLLIN, 0}, {events_.get(), POLLIN, 0}, {clock_steps_.get(), POLLIN, 0}};
        ::poll(sources, 3, look_ms);
        if (::read(clock_steps_.get(), rubbish, sizeof rubbish) < 0 && errno == ECANCELED) arm(clock_steps_.get());
        clock_.measure();
        while (::recv(events_.get(), rubbish, sizeof rubbish, 0) > 0) {}  // only that something changed counts
        if (!ending_) look();
    }
}

void Keeper::look() {
    Interface now = ask(name_);
    if (now.index != 0 && now.index != index_) {
        if (now.ethernet && receiver_.bind(now.index) && sender_.bind(now.index)) index_ = now.index;
        else now.up = false;
    }
    now.up = now.up && now.index != 0;
    if (const auto l = receiver_.lost(); l != 0) lost.fetch_add(l, std::memory_order_relaxed);
    take(now);
}

void Keeper::take(const Interface& now) {
    if (now.mtu != 0) sender_.mtu.store(now.mtu, std::memory_order_relaxed);
    speed.store(now.speed, std::memory_order_relaxed);
    if (now.up == sender_.up.load()) return;
    if (now.up) sender_.forget();
    else downs.fetch_add(1, std::memory_order_relaxed);
    sender_.up.store(now.up);
}

}  // namespace hal::ethernet::rawether
