// SPDX-License-Identifier: MIT
#include "controller_monitor.hpp"

#include <linux/can/netlink.h>
#include <linux/if_link.h>
#include <linux/netlink.h>
#include <linux/rtnetlink.h>
#include <net/if.h>
#include <net/if_arp.h>
#include <sys/socket.h>

#include <cstdint>
#include <vector>

namespace hal::can::socketcan {

namespace {

constexpr unsigned flag_echo = 1U << 18;  // IFF_ECHO, which net/if.h does not have

struct Request {
    nlmsghdr header{};
    ifinfomsg info{};
    char attributes[256]{};

    rtattr* add(unsigned short type, const void* data, std::size_t size) {
        auto* a = reinterpret_cast<rtattr*>(reinterpret_cast<char*>(this) +
                                            NLMSG_ALIGN(header.nlmsg_len));
        a->rta_type = type;
        a->rta_len = static_cast<unsigned short>(RTA_LENGTH(size));
        if (size != 0) {
            std::memcpy(RTA_DATA(a), data, size);
        }
        header.nlmsg_len =
            static_cast<std::uint32_t>(NLMSG_ALIGN(header.nlmsg_len) + RTA_ALIGN(a->rta_len));
        return a;
    }
    void end(rtattr* nest) {
        nest->rta_len = static_cast<unsigned short>(
            reinterpret_cast<char*>(this) + header.nlmsg_len - reinterpret_cast<char*>(nest));
    }
};

/// Sends a request and returns the first response; empty with `errno` set on failure.
std::vector<char> answer(Request& request) {
    const link::Descriptor socket(::socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC, NETLINK_ROUTE));
    if (!socket || ::send(socket.get(), &request, request.header.nlmsg_len, 0) < 0) {
        return {};
    }
    if (!link::readable_within(socket.get(), 1'000'000'000)) {
        return {};
    }
    std::vector<char> buffer(32768);
    const auto size = ::recv(socket.get(), buffer.data(), buffer.size(), MSG_DONTWAIT);
    buffer.resize(size > 0 ? static_cast<std::size_t>(size) : 0);
    return buffer;
}

template <class Visit>
void each_attribute(const rtattr* a, std::size_t left, const Visit& visit) {
    for (auto size = static_cast<int>(left); RTA_OK(a, size); a = RTA_NEXT(a, size)) {
        visit(a->rta_type & NLA_TYPE_MASK, a);
    }
}
template <class Visit>
void each_within(const rtattr* nest, const Visit& visit) {
    each_attribute(static_cast<const rtattr*>(RTA_DATA(nest)), RTA_PAYLOAD(nest), visit);
}
template <class T>
T value(const rtattr* a) {
    T v{};
    std::memcpy(&v, RTA_DATA(a), RTA_PAYLOAD(a) < sizeof v ? RTA_PAYLOAD(a) : sizeof v);
    return v;
}

State state_of(std::uint32_t kernel) {
    switch (kernel) {
    case CAN_STATE_ERROR_ACTIVE: return State::active;
    case CAN_STATE_ERROR_WARNING: return State::warning;
    case CAN_STATE_ERROR_PASSIVE: return State::passive;
    case CAN_STATE_BUS_OFF: return State::bus_off;
    default: return State::down;
    }
}

void read_controller(const rtattr* info, Interface& found) {
    each_within(info, [&](int type, const rtattr* a) {
        const auto* text = static_cast<const char*>(RTA_DATA(a));
        if (type == IFLA_INFO_KIND) {
            found.kind.assign(text, strnlen(text, RTA_PAYLOAD(a)));
        }
        if (type != IFLA_INFO_DATA || found.kind != "can") return;
        each_within(a, [&](int what, const rtattr* b) {
            if (what == IFLA_CAN_BITTIMING) {
                found.bit_rate = value<can_bittiming>(b).bitrate;
            }
            if (what == IFLA_CAN_DATA_BITTIMING) {
                found.data_rate = value<can_bittiming>(b).bitrate;
            }
            if (what == IFLA_CAN_CTRLMODE) {
                found.listen_only = (value<can_ctrlmode>(b).flags & CAN_CTRLMODE_LISTENONLY) != 0;
            }
            if (what == IFLA_CAN_STATE) {
                found.has_state = true;
                found.state = state_of(value<std::uint32_t>(b));
            }
            if (what != IFLA_CAN_BERR_COUNTER) return;
            const auto counters = value<can_berr_counter>(b);
            found.has_counters = true;
            found.send_errors =
                static_cast<std::uint8_t>(counters.txerr < 255 ? counters.txerr : 255);
            found.receive_errors =
                static_cast<std::uint8_t>(counters.rxerr < 255 ? counters.rxerr : 255);
        });
    });
}

}  // namespace

Interface ask(const std::string& name) {
    Interface found;
    Request request;
    request.header.nlmsg_len = NLMSG_LENGTH(sizeof(ifinfomsg));
    request.header.nlmsg_type = RTM_GETLINK;
    request.header.nlmsg_flags = NLM_F_REQUEST;
    request.add(IFLA_IFNAME, name.c_str(), name.size() < IFNAMSIZ ? name.size() + 1 : IFNAMSIZ);
    const auto buffer = answer(request);
    const auto* header = reinterpret_cast<const nlmsghdr*>(buffer.data());
    if (buffer.empty() || !NLMSG_OK(header, buffer.size()) || header->nlmsg_type != RTM_NEWLINK) {
        return found;
    }
    const auto* info = static_cast<const ifinfomsg*>(NLMSG_DATA(header));
    found.index = info->ifi_index;
    found.is_can = info->ifi_type == ARPHRD_CAN;
    found.up = (info->ifi_flags & IFF_UP) != 0;
    found.has_echo = (info->ifi_flags & flag_echo) != 0;
    each_attribute(IFLA_RTA(info), IFLA_PAYLOAD(header), [&](int type, const rtattr* a) {
        if (type == IFLA_MTU) {
            found.mtu = value<std::uint32_t>(a);
        }
        if (type == IFLA_LINKINFO) {
            read_controller(a, found);
        }
    });
    return found;
}

ControllerMonitor::ControllerMonitor(std::string name, Counting& counting, int index,
                                     std::uint32_t restart_ms, std::function<bool(int)> reopen)
    : name_(std::move(name)),
      counting_(counting),
      index_(index),
      restart_ms_(restart_ms),
      reopen_(std::move(reopen)) {
    monitor_.emplace("can-monitor", 500, [this] { look(); });
}

void ControllerMonitor::publish_figures(const Interface& now) {
    if (now.bit_rate != 0) {
        counting_.bit_rate.store(now.bit_rate);
    }
    if (now.data_rate != 0) {
        counting_.data_rate.store(now.data_rate);
    }
    if (now.has_counters) {
        counting_.send_errors.store(now.send_errors);
        counting_.receive_errors.store(now.receive_errors);
    }
}

/// Error frames report the state of an interface whose driver has no state: such a one is
/// active when it returns.
State ControllerMonitor::publish_state(const Interface& now, State before) {
    if (now.has_state) {
        counting_.state.store(now.state);
        return now.state;
    }
    if (before == State::down) {
        counting_.state.compare_exchange_strong(before, State::active);
    }
    return counting_.state.load();
}

void ControllerMonitor::follow_bus_off(const Interface& now) {
    const std::int64_t time_ns = link::monotonic_ns();
    if (off_since_ns_ == 0) {
        off_since_ns_ = time_ns;
    }
    const bool due = restart_ms_ != 0 && time_ns - off_since_ns_ >= restart_ms_ * 1'000'000LL;
    const bool restarts = due || wants_restart.exchange(false);
    if (restarts && restart_controller(now.index)) {
        off_since_ns_ = 0;
    }
}

/// Reads the state, the bit rates and the error counters of the interface from the kernel. An
/// interface that was replaced is opened again. A controller that is off the bus is restarted when
/// its time is over, or on request.
void ControllerMonitor::look() {
    const Interface now = ask(name_);
    const State before = counting_.state.load();
    if (now.index == 0 || !now.is_can || !now.up) return counting_.state.store(State::down);
    if (now.index != index_) {
        if (!reopen_(now.index)) return;
        index_ = now.index;
    }
    publish_figures(now);
    const State state = publish_state(now, before);
    if (before == State::down && state != State::down) {
        Counting::add(counting_.restarts);
    }
    if (state == State::bus_off) {
        follow_bus_off(now);
    } else {
        off_since_ns_ = 0;
    }
}

/// Restarts the controller. Needs CAP_NET_ADMIN; without it the interface's own restart-ms does it.
bool ControllerMonitor::restart_controller(int index) {
    Request request;
    request.header.nlmsg_len = NLMSG_LENGTH(sizeof(ifinfomsg));
    request.header.nlmsg_type = RTM_NEWLINK;
    request.header.nlmsg_flags = NLM_F_REQUEST | NLM_F_ACK;
    request.info.ifi_index = index;
    auto* link = request.add(IFLA_LINKINFO, nullptr, 0);
    request.add(IFLA_INFO_KIND, "can", 3);
    auto* data = request.add(IFLA_INFO_DATA, nullptr, 0);
    const std::uint32_t one = 1;
    request.add(IFLA_CAN_RESTART, &one, sizeof one);
    request.end(data);
    request.end(link);
    const auto buffer = answer(request);
    const auto* header = reinterpret_cast<const nlmsghdr*>(buffer.data());
    if (buffer.empty() || !NLMSG_OK(header, buffer.size()) || header->nlmsg_type != NLMSG_ERROR) {
        return false;
    }
    return static_cast<const nlmsgerr*>(NLMSG_DATA(header))->error == 0;
}

}  // namespace hal::can::socketcan
