// SPDX-License-Identifier: MIT
#include "netlink/link_monitor.hpp"

#include <linux/netlink.h>
#include <linux/rtnetlink.h>
#include <pthread.h>
#include <sys/eventfd.h>
#include <sys/socket.h>

#include <algorithm>
#include <chrono>
#include <iterator>
#include <thread>
#include <utility>

namespace hal::link {

LinkMonitor::LinkMonitor(const char* thread_name, int every_ms, std::function<void()> look,
                         int also)
    : every_ms_(every_ms),
      also_(also),
      look_(std::move(look)),
      events_(::socket(AF_NETLINK, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, NETLINK_ROUTE)),
      wake_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
    sockaddr_nl address{};
    address.nl_family = AF_NETLINK;
    address.nl_groups = RTMGRP_LINK;
    const auto* where = reinterpret_cast<const sockaddr*>(&address);
    // then it checks every `every_ms` only
    if (events_ && ::bind(events_.get(), where, sizeof address) != 0) {
        events_ = {};
    }
    thread_ = std::thread([this, thread_name] {
        pthread_setname_np(pthread_self(), thread_name);
        run();
    });
}

LinkMonitor::~LinkMonitor() {
    ending_ = true;
    nudge();
    thread_.join();
}

void LinkMonitor::nudge() noexcept {
    const std::uint64_t one = 1;
    (void)!::write(wake_.get(), &one, sizeof one);
}

void LinkMonitor::run() {
    char discarded[8192];
    while (!ending_) {
        pollfd sources[] = {
            {wake_.get(), POLLIN, 0}, {events_.get(), POLLIN, 0}, {also_, POLLIN, 0}};
        ::poll(sources, 3, every_ms_);
        // poll() does not sleep on a descriptor that another part of the process has closed
        if (std::any_of(std::begin(sources), std::end(sources),
                        [](const pollfd& source) { return (source.revents & POLLNVAL) != 0; })) {
            std::this_thread::sleep_for(std::chrono::milliseconds(every_ms_));
        }
        while (::read(wake_.get(), discarded, sizeof discarded) > 0) {
        }
        // the content is irrelevant: a change was reported
        while (::recv(events_.get(), discarded, sizeof discarded, 0) > 0) {
        }
        if (!ending_) {
            look_();
        }
    }
}

}  // namespace hal::link
