// SPDX-License-Identifier: MIT
#include <arpa/inet.h>
#include <ifaddrs.h>
#include <linux/if_packet.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <cstring>
#include <vector>

#include "link/address.hpp"
#include "link/datagram_listener.hpp"
#include "link/system.hpp"
#include "text/numbers.hpp"

namespace hal::datagram {

namespace {

constexpr std::size_t max_waiting = 256;

bool has_address(const ifaddrs* of, in_addr_t address) {
    if (of->ifa_addr == nullptr || of->ifa_addr->sa_family != AF_INET) return false;
    sockaddr_in in{};
    std::memcpy(&in, of->ifa_addr, sizeof in);
    return in.sin_addr.s_addr == address;
}

/// Returns the hardware address of an interface, by its name.
std::array<std::uint8_t, 6> hardware_address(const ifaddrs* all, std::string_view name) {
    std::array<std::uint8_t, 6> mac{};
    for (const ifaddrs* i = all; i != nullptr; i = i->ifa_next) {
        if (i->ifa_addr == nullptr || i->ifa_addr->sa_family != AF_PACKET) continue;
        if (name != i->ifa_name) continue;
        sockaddr_ll link{};
        std::memcpy(&link, i->ifa_addr, sizeof link);
        std::copy_n(link.sll_addr, mac.size(), mac.begin());
    }
    return mac;
}

std::array<std::uint8_t, 6> mac_of(in_addr_t address) {
    ifaddrs* all = nullptr;
    if (getifaddrs(&all) != 0) return {};
    std::array<std::uint8_t, 6> mac{};
    for (const ifaddrs* i = all; i != nullptr; i = i->ifa_next) {
        if (has_address(i, address)) {
            mac = hardware_address(all, i->ifa_name);
        }
    }
    freeifaddrs(all);
    return mac;
}

class UdpListener final : public Listener {
public:
    explicit UdpListener(std::string address) : address_(std::move(address)) {}

    /// Returns the problem, or "".
    std::string open(const sockaddr_in& at) {
        socket_ = link::Descriptor(::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
        if (!socket_) return "cannot open a socket: " + link::reason();
        if (::bind(socket_.get(), reinterpret_cast<const sockaddr*>(&at), sizeof at) != 0) {
            if (errno == EADDRNOTAVAIL) {
                return address_ + " is not an address of this computer; see: ip address";
            }
            return "cannot listen at " + address_ + ": " + link::reason();
        }
        const int on = 1;  // without it the time of a datagram is that at which it is handled
        ::setsockopt(socket_.get(), SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on);
        mac_ = mac_of(at.sin_addr.s_addr);
        return {};
    }

    void serve(Server& server, std::int64_t wait_ns) override {
        pollfd p{socket_.get(), POLLIN, 0};
        const std::int64_t due_ns = next_due_ns() - link::monotonic_ns();
        constexpr std::int64_t max_wait_ns = 1'000'000'000;
        const timespec limit =
            link::to_timespec(std::clamp<std::int64_t>(std::min(wait_ns, due_ns), 0, max_wait_ns));
        ppoll(&p, 1, &limit, nullptr);
        std::array<std::uint8_t, max_size> buffer;
        constexpr int batch = 64;  // then what is due is sent
        const std::int64_t to_monotonic_ns = link::real_to_monotonic_ns();
        for (int n = 0; n < batch; ++n) {
            Arrival arrival;
            const std::size_t length = receive(buffer, arrival);
            if (length == 0) break;
            Outbox outbox(*this, arrival.from);
            server.serve(std::span(buffer).first(length), arrival.at_ns + to_monotonic_ns, outbox);
        }
        send_due(link::monotonic_ns());
    }
    const std::array<std::uint8_t, 6>& mac() const noexcept override { return mac_; }
    const std::string& address() const noexcept override { return address_; }

private:
    struct Waiting {
        sockaddr_in to{};
        std::int64_t at_ns = 0;
        std::vector<std::uint8_t> bytes;
    };
    struct Arrival {
        sockaddr_in from{};
        std::int64_t at_ns = 0;  ///< CLOCK_REALTIME, when the kernel received it
    };
    /// Copies the oldest datagram. Returns its size; 0: none has arrived.
    std::size_t receive(std::span<std::uint8_t> to, Arrival& arrival) noexcept {
        iovec part{to.data(), to.size()};
        alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(timespec))> control{};
        msghdr message{};
        message.msg_name = &arrival.from;
        message.msg_namelen = sizeof arrival.from;
        message.msg_iov = &part;
        message.msg_iovlen = 1;
        message.msg_control = control.data();
        message.msg_controllen = control.size();
        const auto length = ::recvmsg(socket_.get(), &message, MSG_DONTWAIT);
        arrival.at_ns = link::clock_ns(CLOCK_REALTIME);
        const cmsghdr* const stamp = CMSG_FIRSTHDR(&message);
        if (stamp != nullptr && stamp->cmsg_type == SCM_TIMESTAMPNS) {
            timespec time{};
            std::memcpy(&time, CMSG_DATA(stamp), sizeof time);
            arrival.at_ns = time.tv_sec * 1'000'000'000LL + time.tv_nsec;
        }
        return length > 0 ? static_cast<std::size_t>(length) : 0;
    }
    /// Answers to one request.
    class Outbox final : public Replies {
    public:
        Outbox(UdpListener& listener, const sockaddr_in& to) : listener_(listener), to_(to) {}
        void send(std::span<const std::uint8_t> bytes, std::int64_t at_ns) noexcept override {
            if (at_ns <= link::monotonic_ns()) {
                listener_.transmit(to_, bytes);
            } else if (listener_.waiting_.size() < max_waiting) {
                listener_.waiting_.push_back({to_, at_ns, {bytes.begin(), bytes.end()}});
            }
        }

    private:
        UdpListener& listener_;
        const sockaddr_in& to_;
    };

    void transmit(const sockaddr_in& to, std::span<const std::uint8_t> bytes) noexcept {
        ::sendto(socket_.get(), bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL,
                 reinterpret_cast<const sockaddr*>(&to), sizeof to);
    }
    std::int64_t next_due_ns() const {
        std::int64_t next = INT64_MAX;
        for (const Waiting& one : waiting_) {
            next = std::min(next, one.at_ns);
        }
        return next;
    }
    void send_due(std::int64_t now_ns) {
        std::ranges::stable_sort(waiting_, {}, &Waiting::at_ns);
        const auto later =
            std::ranges::find_if(waiting_, [&](const Waiting& one) { return one.at_ns > now_ns; });
        for (auto one = waiting_.begin(); one != later; ++one) {
            transmit(one->to, one->bytes);
        }
        waiting_.erase(waiting_.begin(), later);
    }

    const std::string address_;
    link::Descriptor socket_;
    std::array<std::uint8_t, 6> mac_{};
    std::vector<Waiting> waiting_;
};

}  // namespace

Listening listen(std::string_view address, std::uint16_t port) {
    const std::size_t colon = address.find(':');
    const std::string host(address.substr(0, colon));
    if (colon != address.npos && (!parse_whole(address.substr(colon + 1), port) || port == 0)) {
        return {nullptr, "invalid port in " + link::quoted(address) + "; write HOST:PORT"};
    }
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_port = htons(port);
    if (inet_pton(AF_INET, host.c_str(), &at.sin_addr) != 1 || at.sin_addr.s_addr == INADDR_ANY) {
        return {nullptr, "invalid address " + link::quoted(address) +
                             "; write an IP address of this computer, as in 127.0.0.1"};
    }
    auto opened = std::make_unique<UdpListener>(host + ":" + std::to_string(port));
    if (std::string problem = opened->open(at); !problem.empty()) {
        return {nullptr, std::move(problem)};
    }
    return {std::move(opened), {}};
}

}  // namespace hal::datagram
