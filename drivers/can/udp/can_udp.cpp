// SPDX-License-Identifier: MIT
#include "can_udp.hpp"

#include <arpa/inet.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/uio.h>

#include <cstdlib>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "datagram.hpp"
#include "hal/queue.hpp"
#include "link/drop_counter.hpp"
#include "link/filtering.hpp"
#include "link/system.hpp"

namespace hal::can::canudp {

namespace {

constexpr std::size_t batch = 16;  // datagrams per system call

/// A multicast group: its IPv4 or IPv6 address and port, and its interface.
struct MulticastGroup {
    sockaddr_storage address{};
    socklen_t size = 0;
    unsigned interface = 0;  ///< its index; 0: by the routing table
    std::string text;        ///< the complete address of the link
    bool is_ipv6() const { return address.ss_family == AF_INET6; }
};

/// The parts of an address; those that are not written have their defaults.
struct AddressParts {
    std::string group = "239.74.163.2";  // the default of stock tools
    std::string port = "43113";
    std::string interface;
};

/// Splits `GROUP`, `GROUP:PORT`, `[GROUP6]` or `[GROUP6]:PORT`, each with an optional `%INTERFACE`
/// after the group.
AddressParts split_address(std::string_view text) {
    AddressParts parts;
    if (text.starts_with('[')) {
        const auto end = text.find(']');
        parts.group = text.substr(1, end == text.npos ? end : end - 1);
        text.remove_prefix(end == text.npos ? text.size() : end + 1);
    } else if (const std::string_view group = text.substr(0, text.find(':')); !group.empty()) {
        parts.group = group;
        text.remove_prefix(group.size());
    }
    if (text.starts_with(':')) {
        parts.port = text.substr(1);
    }
    if (const auto percent = parts.group.find('%'); percent != parts.group.npos) {
        parts.interface = parts.group.substr(percent + 1);
        parts.group.resize(percent);
    }
    return parts;
}

/// Returns 0 for an invalid port.
std::uint16_t parse_port(const std::string& text) {
    char* end = nullptr;
    const unsigned long number = std::strtoul(text.c_str(), &end, 10);
    const bool is_number = !text.empty() && *end == '\0';
    return is_number && number <= 65535 ? static_cast<std::uint16_t>(number) : 0;
}

/// Sets the address of a group. Returns false if `text` is not a multicast address.
bool set_address(const std::string& text, std::uint16_t port, MulticastGroup& group) {
    auto& ipv4 = reinterpret_cast<sockaddr_in&>(group.address);
    if (inet_pton(AF_INET, text.c_str(), &ipv4.sin_addr) == 1 &&
        IN_MULTICAST(ntohl(ipv4.sin_addr.s_addr))) {
        ipv4.sin_family = AF_INET;
        ipv4.sin_port = htons(port);
        group.size = sizeof ipv4;
        return true;
    }
    auto& ipv6 = reinterpret_cast<sockaddr_in6&>(group.address);
    if (inet_pton(AF_INET6, text.c_str(), &ipv6.sin6_addr) == 1 &&
        IN6_IS_ADDR_MULTICAST(&ipv6.sin6_addr)) {
        ipv6.sin6_family = AF_INET6;
        ipv6.sin6_port = htons(port);
        group.size = sizeof ipv6;
        return true;
    }
    return false;
}

/// Formats `udp:GROUP:PORT`, with the interface if there is one.
std::string text_of(const AddressParts& parts, bool is_ipv6) {
    const std::string group = is_ipv6 ? "[" + parts.group + "]" : parts.group;
    const std::string interface = parts.interface.empty() ? "" : "%" + parts.interface;
    return "udp:" + group + interface + ":" + parts.port;
}

/// Parses the part of an address behind `udp:`. Sets `problem` if it is invalid, or the interface
/// is missing.
MulticastGroup parse_group(std::string_view text, std::string& problem) {
    const AddressParts parts = split_address(text);
    MulticastGroup group;
    const std::uint16_t port = parse_port(parts.port);
    if (port == 0) {
        problem = "invalid port '" + parts.port + "'; write udp:239.74.163.2:43113";
    }
    if (!parts.interface.empty()) {
        group.interface = if_nametoindex(parts.interface.c_str());
        if (group.interface == 0) {
            problem = "no interface " + parts.interface + "; to list them: ip -br link";
        }
    }
    if (!set_address(parts.group, port, group) && problem.empty()) {
        problem = "invalid multicast group '" + parts.group +
                  "'; write udp:239.74.163.2:" + parts.port + ", the default of stock tools";
    }
    group.text = text_of(parts, group.is_ipv6());
    return group;
}

template <class T>
bool set(int fd, int level, int name, const T& value) {
    return setsockopt(fd, level, name, &value, sizeof value) == 0;
}

link::Descriptor receiver(const MulticastGroup& group, const Options& o, std::string& problem) {
    link::Descriptor fd(
        ::socket(group.address.ss_family, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
    const int yes = 1;
    set(fd.get(), SOL_SOCKET, SO_REUSEADDR, yes);
    set(fd.get(), SOL_SOCKET, SO_REUSEPORT, yes);
    set(fd.get(), SOL_SOCKET, SO_TIMESTAMPNS, yes);
    // the kernel's cost of a datagram
    const int buffer_bytes =
        static_cast<int>((o.receive_capacity < 65536 ? o.receive_capacity : 65536) * 1024);
    if (!set(fd.get(), SOL_SOCKET, SO_RCVBUFFORCE, buffer_bytes)) {
        set(fd.get(), SOL_SOCKET, SO_RCVBUF, buffer_bytes);
    }
    sockaddr_storage any = group.address;
    bool joined = false;
    if (group.is_ipv6()) {
        auto& ipv6 = reinterpret_cast<sockaddr_in6&>(any);
        const ipv6_mreq request{ipv6.sin6_addr, group.interface};
        joined = set(fd.get(), IPPROTO_IPV6, IPV6_JOIN_GROUP, request);
        ipv6.sin6_addr = in6addr_any;
    } else {
        const auto& ipv4 = reinterpret_cast<const sockaddr_in&>(any);
        const ip_mreqn request{ipv4.sin_addr, {INADDR_ANY}, static_cast<int>(group.interface)};
        joined = set(fd.get(), IPPROTO_IP, IP_ADD_MEMBERSHIP, request);
        // Bind to the group: any address would receive every group on this port.
    }
    if (!joined) {
        problem = "cannot join the group: " + link::reason() +
                  "; without a route to it, type: sudo ip route add 224.0.0.0/4 dev lo";
    } else if (::bind(fd.get(), reinterpret_cast<const sockaddr*>(&any), group.size) != 0) {
        problem =
            "cannot bind to the port: " + link::reason() + "; to find another user of it: ss -ulp";
    }
    return fd;
}

link::Descriptor sender(const MulticastGroup& group, std::string& problem) {
    link::Descriptor fd(
        ::socket(group.address.ss_family, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
    const int one = 1;  // hop limit 1, and loopback to this machine
    if (group.is_ipv6()) {
        set(fd.get(), IPPROTO_IPV6, IPV6_MULTICAST_HOPS, one);
        if (group.interface != 0) {
            set(fd.get(), IPPROTO_IPV6, IPV6_MULTICAST_IF, group.interface);
        }
    } else {
        set(fd.get(), IPPROTO_IP, IP_MULTICAST_TTL, one);
        if (group.interface != 0) {
            set(fd.get(), IPPROTO_IP, IP_MULTICAST_IF,
                ip_mreqn{{}, {INADDR_ANY}, static_cast<int>(group.interface)});
        }
    }
    if (::connect(fd.get(), reinterpret_cast<const sockaddr*>(&group.address), group.size) != 0) {
        problem = "no route to the group: " + link::reason() +
                  "; type: sudo ip route add 224.0.0.0/4 dev lo";
    }
    return fd;
}

class UdpLink final : public FilteringLink {
public:
    UdpLink(const MulticastGroup& target, const Options& options, link::Descriptor in,
            link::Descriptor out)
        : options_(options),
          in_(std::move(in)),
          out_(std::move(out)),
          outgoing_(options.send_capacity) {
        counting_.bit_rate = options.bit_rate != unlimited ? options.bit_rate : 0;
        counting_.data_rate = options.data_rate;
        description_.address = target.text;
        description_.transport = "CAN over UDP multicast";
        description_.bit_rate = counting_.bit_rate;
        description_.data_rate = counting_.data_rate;

        description_.fd = options.fd;
        description_.listen_only = options.listen_only;
        socklen_t size = sizeof self_;
        getsockname(out_.get(), reinterpret_cast<sockaddr*>(&self_), &size);
    }

    Sent send(const Frame& frame, std::int64_t now_ns) noexcept override {
        if (!may_send(frame, options_)) return counting_.drop(Sent::rejected);
        if (outgoing_.push(frame)) return Sent::queued;
        flush(now_ns);
        return outgoing_.push(frame) ? Sent::queued : counting_.drop(Sent::full);
    }

    void flush(std::int64_t) noexcept override {
        if (outgoing_.front() == nullptr) return;
        const auto time = link::clock_ns(CLOCK_REALTIME);
        for (;;) {
            mmsghdr messages[batch]{};
            iovec parts[batch]{};
            unsigned count = 0;
            for (; count < batch; ++count) {
                const Frame* f = outgoing_.at(count);
                if (f == nullptr) break;
                parts[count] = {out_buffers_[count].data(), encode(*f, time, out_buffers_[count])};
                messages[count].msg_hdr.msg_iov = &parts[count];
                messages[count].msg_hdr.msg_iovlen = 1;
            }
            if (count == 0) return;
            const int sent = ::sendmmsg(out_.get(), messages, count, MSG_DONTWAIT | MSG_NOSIGNAL);
            if (sent <= 0) {
                if (errno == EINTR) continue;
                const bool waits = errno == EAGAIN || errno == ENOBUFS || errno == ECONNREFUSED;
                counting_.state.store(waits ? State::active : State::down,
                                      std::memory_order_relaxed);
                return;  // continue in the next cycle
            }
            counting_.state.store(State::active, std::memory_order_relaxed);
            for (int i = 0; i < sent; ++i) {
                counting_.count_sent(*outgoing_.at(static_cast<std::size_t>(i)));
            }
            outgoing_.drop(static_cast<std::size_t>(sent));
        }
    }

    void discard_queued() noexcept override {
        for (; outgoing_.front() != nullptr; outgoing_.drop()) {
            Counting::add(counting_.dropped);
        }
    }

    std::size_t receive(std::span<Frame> frames, std::int64_t now_ns) noexcept override {
        std::size_t count = 0;
        int useless = 0;
        while (count < frames.size()) {
            if (next_ == filled_ && !refill(now_ns)) {
                if (was_short_ || ++useless == 4) break;
                continue;  // the whole batch was filtered out
            }
            frames[count++] = buffer_[next_++];
        }
        return count;
    }

    Statistics statistics() const noexcept override { return counting_.read(outgoing_.size()); }
    bool wait(std::int64_t at_most_ns) override {
        return next_ != filled_ || link::readable_within(in_.get(), at_most_ns);
    }
    int descriptor() const noexcept override { return in_.get(); }

private:
    /// Receives a batch of datagrams, and keeps the frames in them that pass the options and the
    /// filters. Returns whether there are any. [realtime]
    bool refill(std::int64_t now_ns) noexcept {
        // one system call per cycle unless the batch was full
        if (now_ns != unclocked && was_short_ && now_ns == requested_at_) return false;
        mmsghdr messages[batch]{};
        iovec parts[batch]{};
        sockaddr_storage from[batch];
        alignas(cmsghdr) char control[batch][CMSG_SPACE(sizeof(timespec))];
        for (std::size_t i = 0; i < batch; ++i) {
            parts[i] = {in_buffers_[i].data(), in_buffers_[i].size()};
            messages[i].msg_hdr.msg_iov = &parts[i];
            messages[i].msg_hdr.msg_iovlen = 1;
            messages[i].msg_hdr.msg_name = &from[i];
            messages[i].msg_hdr.msg_namelen = sizeof from[i];
            messages[i].msg_hdr.msg_control = control[i];
            messages[i].msg_hdr.msg_controllen = sizeof control[i];
        }
        const int got = ::recvmmsg(in_.get(), messages, batch, MSG_DONTWAIT, nullptr);
        next_ = filled_ = 0;
        requested_at_ = now_ns;
        was_short_ = got < static_cast<int>(batch);
        Counting::add(
            counting_.lost,
            drops_.update(in_.get(), got > 0 ? static_cast<std::size_t>(got) : 0, was_short_));
        counting_.tick(now_ns != unclocked ? now_ns : link::monotonic_ns());
        const auto offset = got > 0 ? link::real_to_monotonic_ns() : 0;
        for (int i = 0; i < got; ++i) {
            Frame& f = buffer_[filled_];
            auto& header = messages[i].msg_hdr;
            if ((header.msg_flags & MSG_TRUNC) != 0 ||
                !decode({in_buffers_[static_cast<std::size_t>(i)].data(), messages[i].msg_len},
                        f)) {
                Counting::add(counting_.errors);
                continue;
            }
            f.time_ns = stamp_of(header, offset);
            f.own = is_self(from[i]);
            if (!is_wanted(f)) continue;
            counting_.count_received(f);
            ++filled_;
        }
        return filled_ != 0;
    }
    /// Returns the kernel's time of a datagram on the monotonic clock, `offset` from the real one;
    /// 0: it has none. [realtime]
    static std::int64_t stamp_of(msghdr& header, std::int64_t offset) noexcept {
        for (cmsghdr* c = CMSG_FIRSTHDR(&header); c != nullptr; c = CMSG_NXTHDR(&header, c)) {
            if (c->cmsg_level != SOL_SOCKET || c->cmsg_type != SCM_TIMESTAMPNS) continue;
            timespec t{};
            std::memcpy(&t, CMSG_DATA(c), sizeof t);
            return t.tv_sec * 1'000'000'000LL + t.tv_nsec + offset;
        }
        return 0;
    }
    /// [realtime]
    bool is_wanted(const Frame& f) const noexcept {
        if (f.own && !options_.own_frames) return false;
        if (f.fd && !options_.fd) return false;
        if (f.error) return options_.error_frames;
        return filters_.pass(f);
    }

    bool is_self(const sockaddr_storage& a) const noexcept {
        if (a.ss_family != self_.ss_family) return false;
        if (a.ss_family == AF_INET) {
            const auto &x = reinterpret_cast<const sockaddr_in&>(a),
                       &y = reinterpret_cast<const sockaddr_in&>(self_);
            return x.sin_port == y.sin_port && x.sin_addr.s_addr == y.sin_addr.s_addr;
        }
        const auto &x = reinterpret_cast<const sockaddr_in6&>(a),
                   &y = reinterpret_cast<const sockaddr_in6&>(self_);
        return x.sin6_port == y.sin6_port &&
               std::memcmp(&x.sin6_addr, &y.sin6_addr, sizeof x.sin6_addr) == 0;
    }

    const Options options_;
    const link::Descriptor in_, out_;
    hal::Queue<Frame> outgoing_;  // written and read by the sending thread
    sockaddr_storage self_{};

    Datagram out_buffers_[batch];  // used by the sending thread
    std::array<std::uint8_t, 512> in_buffers_[batch];  // from here on: used by the receiving thread
    Frame buffer_[batch];
    std::size_t next_ = 0;
    std::size_t filled_ = 0;
    std::int64_t requested_at_ = unclocked;
    bool was_short_ = false;
    link::DropCounter drops_;
};

}  // namespace

Description describe(const std::string& target) {
    std::string problem;
    const std::string text = parse_group(target, problem).text;
    return {.address = problem.empty() ? text : "udp:" + target,
            .transport = "CAN over UDP multicast"};
}

Opened open(const std::string& target, const Options& options) {
    std::string problem;
    const MulticastGroup group = parse_group(target, problem);
    if (!problem.empty()) {
        return {nullptr, problem};
    }
    link::Descriptor in = receiver(group, options, problem);
    link::Descriptor out = problem.empty() ? sender(group, problem) : link::Descriptor{};
    if (!problem.empty()) {
        return {nullptr, problem};
    }
    return {std::make_unique<UdpLink>(group, options, std::move(in), std::move(out)), {}};
}

}  // namespace hal::can::canudp
