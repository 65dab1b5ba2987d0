// SPDX-License-Identifier: MIT
#include "udp_datagram.hpp"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <netdb.h>
#include <sys/socket.h>

#include <bit>
#include <cstring>

#include "link/system.hpp"
#include "text/numbers.hpp"

namespace hal::datagram::udp {

namespace {

std::string text_of(const in_addr& address) {
    char text[INET_ADDRSTRLEN] = {};
    inet_ntop(AF_INET, &address, text, sizeof text);
    return text;
}

in_addr address_of(const sockaddr* address) {
    sockaddr_in in{};
    std::memcpy(&in, address, sizeof in);
    return in.sin_addr;
}

/// Returns a sentence when this machine reaches the host through a router: cards have a subnet of
/// their own, and behind a router a missing card does not answer either.
std::string subnet_remark(const in_addr& own, const in_addr& host) {
    ifaddrs* all = nullptr;
    if (getifaddrs(&all) != 0) return {};
    std::string remark;
    for (const ifaddrs* i = all; i != nullptr; i = i->ifa_next) {
        if (i->ifa_addr == nullptr || i->ifa_addr->sa_family != AF_INET) continue;
        if (i->ifa_netmask == nullptr || address_of(i->ifa_addr).s_addr != own.s_addr) continue;
        const in_addr_t mask = address_of(i->ifa_netmask).s_addr;
        if (((own.s_addr ^ host.s_addr) & mask) == 0) continue;
        remark = text_of(host) + " is in another subnet than " + text_of(own) + "/" +
                 std::to_string(std::popcount(mask)) + " of " + i->ifa_name +
                 "; give the interface of the card an address in the subnet of the card";
    }
    freeifaddrs(all);
    return remark;
}

class UdpPort final : public Port {
public:
    UdpPort(Description description, const Options& options)
        : description_(std::move(description)), spin_ns_(options.spin_ns) {}

    /// Returns the problem, or "". [setup]
    std::string open(const sockaddr_in& at) {
        socket_ = link::Descriptor(::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
        if (!socket_) return "cannot open a socket: " + link::reason();
        if (::connect(socket_.get(), reinterpret_cast<const sockaddr*>(&at), sizeof at) != 0) {
            return "no route to " + text_of(at.sin_addr) + ": " + link::reason() +
                   "; see: ip route";
        }
        sockaddr_in own{};
        socklen_t size = sizeof own;
        if (getsockname(socket_.get(), reinterpret_cast<sockaddr*>(&own), &size) == 0) {
            description_.remark = subnet_remark(own.sin_addr, at.sin_addr);
        }
        return {};
    }

    bool send(std::span<const std::uint8_t> bytes, std::int64_t) noexcept override {
        // the first call after an ICMP message returns that as its error
        for (int tries = 0; tries < 2; ++tries) {
            if (::send(socket_.get(), bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL) >=
                0) {
                return true;
            }
        }
        return false;
    }
    std::size_t receive(std::span<std::uint8_t> to, std::int64_t) noexcept override {
        for (int tries = 0; tries < 4; ++tries) {
            const auto size = ::recv(socket_.get(), to.data(), to.size(), MSG_DONTWAIT);
            if (size > 0) return static_cast<std::size_t>(size);
            if (size < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) return 0;
        }
        return 0;
    }
    bool wait(std::int64_t limit_ns) noexcept override {
        const std::int64_t begin_ns = link::monotonic_ns();
        const std::int64_t spin_ns = std::min(spin_ns_, limit_ns);
        std::int64_t passed_ns = 0;
        do {
            if (has_datagram()) return true;
            passed_ns = link::monotonic_ns() - begin_ns;
        } while (passed_ns < spin_ns);
        if (passed_ns >= limit_ns) return false;
        pollfd p{socket_.get(), POLLIN, 0};
        const timespec limit = link::to_timespec(limit_ns - passed_ns);
        return ::ppoll(&p, 1, &limit, nullptr) > 0 && has_datagram();
    }
    const Description& description() const noexcept override { return description_; }

private:
    bool has_datagram() const noexcept {
        std::uint8_t first = 0;
        return ::recv(socket_.get(), &first, 1, MSG_DONTWAIT | MSG_PEEK) > 0;
    }

    Description description_;
    const std::int64_t spin_ns_;
    link::Descriptor socket_;
};

}  // namespace

Opened open(const std::string& target, const Options& options) {
    const std::size_t colon = target.find(':');
    const std::string host = target.substr(0, colon);
    std::uint16_t port = options.port;
    if (colon != target.npos &&
        (!parse_whole(std::string_view(target).substr(colon + 1), port) || port == 0)) {
        return {nullptr, "invalid port " + target.substr(colon + 1) + "; write a number 1..65535"};
    }
    if (host.empty()) return {nullptr, "missing host; write eth:10.10.10.10"};
    addrinfo hints{};
    hints.ai_family = AF_INET;
    hints.ai_socktype = SOCK_DGRAM;
    addrinfo* found = nullptr;
    if (const int error = getaddrinfo(host.c_str(), nullptr, &hints, &found); error != 0) {
        return {nullptr, "cannot resolve " + host + ": " + gai_strerror(error)};
    }
    sockaddr_in at{};
    std::memcpy(&at, found->ai_addr, sizeof at);
    freeaddrinfo(found);
    at.sin_port = htons(port);
    auto opened = std::make_unique<UdpPort>(describe(target), options);
    if (std::string problem = opened->open(at); !problem.empty()) {
        return {nullptr, std::move(problem)};
    }
    return {std::move(opened), {}};
}

Description describe(const std::string& target) {
    return {.address = "eth:" + target, .transport = "UDP"};
}

}  // namespace hal::datagram::udp
