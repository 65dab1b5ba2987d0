// SPDX-License-Identifier: MIT
#include "ethernet_udp.hpp"

#include <arpa/inet.h>
#include <netdb.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstring>

#include "link/drop_counter.hpp"
#include "link/system.hpp"
#include "link/trace_frame.hpp"
#include "text/numbers.hpp"

namespace hal::ethernet {

namespace {

constexpr std::uint32_t ip_and_udp_bytes = 28;
constexpr std::uint32_t max_payload = max_frame - header_bytes;
constexpr std::size_t max_peers = 8;
constexpr std::int64_t peer_timeout_ns = 2'000'000'000;
constexpr std::int64_t announce_every_ns = 500'000'000;
/// in which a host answers that nothing listens there
constexpr std::int64_t refusal_ns = 5'000'000;
constexpr unsigned datagrams_at_once = 64;  ///< read in one call without a frame among them

/// A peer as one word, so that the sending and the receiving thread share it.
std::uint64_t pack(const sockaddr_in& a) noexcept {
    return std::uint64_t{a.sin_addr.s_addr} << 16 | a.sin_port;
}
sockaddr_in unpack(std::uint64_t peer) noexcept {
    sockaddr_in a{};
    a.sin_family = AF_INET;
    a.sin_port = static_cast<in_port_t>(peer & 0xffff);
    a.sin_addr.s_addr = static_cast<in_addr_t>(peer >> 16);
    return a;
}

template <class T>
bool set(int fd, int level, int name, const T& value) {
    return setsockopt(fd, level, name, &value, sizeof value) == 0;
}

class UdpPort final : public Port {
public:
    UdpPort(const std::string& target, const Options& options, std::uint16_t type)
        : options_(options), type_(type) {
        description_ = udp::describe(target);
    }

    /// Opens the socket towards a host, or on it. Returns the problem, or "". [setup]
    std::string open(const std::string& host, const sockaddr_in& at) {
        socket_ = link::Descriptor(::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
        if (!socket_) return "cannot open a socket: " + link::reason();
        set(socket_.get(), SOL_SOCKET, SO_NO_CHECK, 1);
        set(socket_.get(), SOL_SOCKET, SO_TIMESTAMPNS, 1);
        set(socket_.get(), SOL_SOCKET, SO_RCVBUF,
            static_cast<int>(std::min<std::size_t>(options_.receive_capacity, 16384) * 2048));
        const auto* address = reinterpret_cast<const sockaddr*>(&at);
        const std::string where = host + ":" + std::to_string(ntohs(at.sin_port));
        if (options_.listen) {
            if (::bind(socket_.get(), address, sizeof at) == 0) {
                name_station();
                return std::string();
            }
            if (errno == EADDRNOTAVAIL) {
                return host +
                       " is not an address of this machine; to listen on all of them, write "
                       "udp:0.0.0.0";
            }
            return "cannot listen on " + where + ": " + link::reason() +
                   "; to find the program that does: ss -ulpn";
        }
        if (::connect(socket_.get(), address, sizeof at) != 0) {
            return "no route to " + where + ": " + link::reason() + "; see: ip route";
        }
        int mtu = 0;
        socklen_t size = sizeof mtu;
        if (getsockopt(socket_.get(), IPPROTO_IP, IP_MTU, &mtu, &size) == 0 &&
            mtu > static_cast<int>(ip_and_udp_bytes)) {
            mtu_ = std::min(static_cast<std::uint32_t>(mtu) - ip_and_udp_bytes, max_payload);
        }
        name_station();
        announce(link::monotonic_ns());
        pollfd refused{socket_.get(), 0, 0};
        const timespec limit{0, refusal_ns};
        if (::ppoll(&refused, 1, &limit, nullptr) > 0) {
            note_refusal();
        }
        return {};
    }

    const Address& address() const noexcept override { return address_; }

    Sent send(std::span<const std::uint8_t> frame, const Launch& launch,
              std::int64_t) noexcept override {
        if (!launch.fits(frame.size()) || frame.size() > max_frame) {
            add(dropped_);
            add(errors_);
            return Sent::rejected;
        }
        std::int64_t now = link::monotonic_ns();
        if (launch.at_ns - now > options_.spin_ns) {
            add(dropped_);
            return Sent::full;
        }
        while (now < launch.at_ns) {
            now = link::monotonic_ns();
        }
        if (launch.is_late(now)) {
            add(late_);
            return Sent::late;
        }
        std::array<std::uint8_t, max_frame> buffer;
        const std::span<std::uint8_t> copy{buffer.data(), frame.size()};
        if (launch.stamp_at != 0 || launch.finisher != nullptr) {
            std::copy(frame.begin(), frame.end(), copy.begin());
            frame = copy;
        }
        if (launch.stamp_at != 0) {
            stamp(copy.subspan(launch.stamp_at), now + launch.stamp_add_ns);
        }
        if (launch.finisher != nullptr) {
            launch.finisher->leaves(copy);
        }
        if (!send_to_all(frame.subspan(header_bytes), now)) {
            if (launch.finisher != nullptr) {
                launch.finisher->stayed(copy);
            }
            add(dropped_);
            return Sent::full;
        }
        link::trace_frame(link::ethernet_sent, frame);
        add(sent_);
        sent_bytes_.fetch_add(frame.size(), std::memory_order_relaxed);
        return Sent::queued;
    }

    std::optional<Arrival> receive(std::int64_t) noexcept override {
        for (unsigned n = 0; n < datagrams_at_once; ++n) {
            Datagram datagram;
            if (!read(datagram)) {
                if (errno == EINTR) continue;
                if (errno == ECONNREFUSED) {  // of an earlier datagram
                    set_up(false);
                    continue;
                }
                count_lost(0, true);
                return std::nullopt;
            }
            count_lost(1, false);
            set_up(true);
            if (options_.listen) {
                remember(datagram.sender, datagram.received_ns);
            }
            const bool is_announcement = datagram.length == 0;
            if (is_announcement) continue;
            if (datagram.truncated) {
                add(errors_);
                continue;
            }
            return frame_of(datagram);
        }
        return std::nullopt;
    }

    bool wait(std::int64_t until_ns) noexcept override {
        for (auto now = link::monotonic_ns();; now = link::monotonic_ns()) {
            auto end = until_ns;
            if (!options_.listen) {
                const auto due = last_sent_ns_.load(std::memory_order_relaxed) + announce_every_ns;
                if (now >= due) {
                    announce(now);
                }
                end = std::min(end, std::max(due, now + 1));
            }
            pollfd p{socket_.get(), POLLIN, 0};
            const auto left = std::max<std::int64_t>(end - now, 0);
            const timespec limit = link::to_timespec(left);
            ::ppoll(&p, 1, &limit, nullptr);
            if ((p.revents & POLLIN) != 0) return true;
            if ((p.revents & POLLERR) != 0) {
                note_refusal();
            }
            if (link::monotonic_ns() >= until_ns) return false;
        }
    }

    Statistics statistics() const noexcept override {
        const auto read = [](const auto& counter) {
            return counter.load(std::memory_order_relaxed);
        };
        Statistics s;
        s.up = read(up_);
        s.mtu = mtu_;
        s.sent = read(sent_);
        s.sent_bytes = read(sent_bytes_);
        s.received = read(received_);
        s.received_bytes = read(received_bytes_);
        s.lost = read(lost_);
        s.dropped = read(dropped_);
        s.late = read(late_);
        s.errors = read(errors_);

        s.downs = read(downs_);
        return s;
    }
    const Description& description() const noexcept override { return description_; }
    int descriptor() const noexcept override { return socket_.get(); }

private:
    using Count = std::atomic<std::uint64_t>;
    static void add(Count& counter) noexcept { counter.fetch_add(1, std::memory_order_relaxed); }
    struct Peer {
        std::atomic<std::uint64_t> address{0};  ///< 0: none; written by the receiving thread
        std::atomic<std::int64_t> last_received_ns{0};
    };

    /// Writes a time as eight bytes, the most significant first.
    static void stamp(std::span<std::uint8_t> to, std::int64_t time_ns) noexcept {
        auto rest = static_cast<std::uint64_t>(time_ns);
        for (std::size_t i = 8; i-- > 0;) {
            to[i] = static_cast<std::uint8_t>(rest);
            rest >>= 8;
        }
    }

    /// A datagram whose payload is behind the header in `frame_`.
    struct Datagram {
        std::size_t length = 0;
        bool truncated = false;
        std::uint64_t sender = 0;  ///< packed
        std::int64_t received_ns = 0;
        std::int64_t time_ns = 0;  ///< of the arrival, by the kernel
    };
    /// Reads a datagram. Returns false with the reason in errno.
    bool read(Datagram& datagram) noexcept {
        sockaddr_in from{};
        alignas(cmsghdr) char control[CMSG_SPACE(sizeof(timespec))];
        iovec payload{frame_.data() + header_bytes, frame_.size() - header_bytes};
        msghdr header{};
        header.msg_name = &from;
        header.msg_namelen = sizeof from;
        header.msg_iov = &payload;
        header.msg_iovlen = 1;
        header.msg_control = control;
        header.msg_controllen = sizeof control;
        const ssize_t length = ::recvmsg(socket_.get(), &header, MSG_DONTWAIT);
        if (length < 0) return false;
        datagram.length = static_cast<std::size_t>(length);
        datagram.truncated = (header.msg_flags & MSG_TRUNC) != 0;
        datagram.sender = pack(from);
        datagram.received_ns = link::monotonic_ns();
        datagram.time_ns = std::min(time_of(header, datagram.received_ns), datagram.received_ns);
        return true;
    }
    void count_lost(std::size_t datagrams, bool drained) noexcept {
        lost_.fetch_add(drops_.update(socket_.get(), datagrams, drained),
                        std::memory_order_relaxed);
    }
    /// Pads the frame of a datagram with zeros to the smallest length, and counts it.
    Arrival frame_of(const Datagram& datagram) noexcept {
        const std::size_t end = header_bytes + datagram.length;
        const std::size_t length = std::max(end, smallest_frame);
        std::fill(frame_.begin() + static_cast<std::ptrdiff_t>(end),
                  frame_.begin() + static_cast<std::ptrdiff_t>(length), std::uint8_t{0});
        const std::span<const std::uint8_t> frame{frame_.data(), length};
        link::trace_frame(link::ethernet_received, frame);
        add(received_);
        received_bytes_.fetch_add(length, std::memory_order_relaxed);
        return Arrival{frame, datagram.time_ns};
    }

    /// Derives the own address and the header of received frames. Frames of the listening end
    /// passed the devices there, which their source address shows (locally administered).
    void name_station() noexcept {
        sockaddr_in self{};
        socklen_t size = sizeof self;
        getsockname(socket_.get(), reinterpret_cast<sockaddr*>(&self), &size);
        const auto port = ntohs(self.sin_port);
        address_ = {2,
                    'U',
                    'D',
                    'P',
                    static_cast<std::uint8_t>(port >> 8),
                    static_cast<std::uint8_t>(port)};
        std::fill_n(frame_.begin(), 6, std::uint8_t{0xff});
        std::copy(address_.begin(), address_.end(), frame_.begin() + 6);
        if (options_.listen) {
            frame_[6] = 0;
        }
        frame_[12] = static_cast<std::uint8_t>(type_ >> 8);

        frame_[13] = static_cast<std::uint8_t>(type_);
    }

    /// Registers this end at the listening one, without a frame. Errors show in receive().
    void announce(std::int64_t now) noexcept {
        (void)!::send(socket_.get(), nullptr, 0, MSG_DONTWAIT | MSG_NOSIGNAL);
        last_sent_ns_.store(now, std::memory_order_relaxed);
    }
    void note_refusal() noexcept {
        int error = 0;
        socklen_t size = sizeof error;
        if (getsockopt(socket_.get(), SOL_SOCKET, SO_ERROR, &error, &size) == 0 &&
            error == ECONNREFUSED) {
            set_up(false);
        }
    }
    void set_up(bool up) noexcept {
        if (up_.exchange(up, std::memory_order_relaxed) && !up) {
            add(downs_);
        }
    }

    void remember(std::uint64_t address, std::int64_t now) noexcept {
        Peer* oldest = peers_.data();
        for (Peer& p : peers_) {
            if (p.address.load(std::memory_order_relaxed) == address) {
                return p.last_received_ns.store(now, std::memory_order_relaxed);
            }
            if (p.last_received_ns.load(std::memory_order_relaxed) <
                oldest->last_received_ns.load(std::memory_order_relaxed)) {
                oldest = &p;
            }
        }
        oldest->address.store(address, std::memory_order_relaxed);
        oldest->last_received_ns.store(now, std::memory_order_relaxed);
    }

    /// Sends to the listening end, or to all that were heard of. Returns whether the system took a
    /// datagram.
    bool send_to_all(std::span<const std::uint8_t> payload, std::int64_t now) noexcept {
        if (!options_.listen) {
            last_sent_ns_.store(now, std::memory_order_relaxed);
            return send_to(nullptr, payload);
        }
        bool taken = false;
        for (const Peer& p : peers_) {
            const auto address = p.address.load(std::memory_order_relaxed);
            if (address == 0 ||
                now - p.last_received_ns.load(std::memory_order_relaxed) > peer_timeout_ns) {
                continue;
            }
            const sockaddr_in to = unpack(address);
            taken |= send_to(&to, payload);
        }
        return taken;
    }
    bool send_to(const sockaddr_in* to, std::span<const std::uint8_t> payload) noexcept {
        for (int tries = 0; tries < 3; ++tries) {
            const auto sent =
                ::sendto(socket_.get(), payload.data(), payload.size(), MSG_DONTWAIT | MSG_NOSIGNAL,
                         reinterpret_cast<const sockaddr*>(to), to == nullptr ? 0 : sizeof *to);
            if (sent >= 0) return true;
            if (errno == ECONNREFUSED) {
                set_up(false);  // of an earlier datagram
            } else if (errno != EINTR) {
                break;
            }
        }
        add(errors_);
        return false;
    }

    static std::int64_t time_of(msghdr& header, std::int64_t now) noexcept {
        for (cmsghdr* c = CMSG_FIRSTHDR(&header); c != nullptr; c = CMSG_NXTHDR(&header, c)) {
            if (c->cmsg_level != SOL_SOCKET || c->cmsg_type != SCM_TIMESTAMPNS) continue;
            timespec t{};
            std::memcpy(&t, CMSG_DATA(c), sizeof t);
            return t.tv_sec * 1'000'000'000LL + t.tv_nsec + link::real_to_monotonic_ns();
        }
        return now;
    }

    const Options options_;
    const std::uint16_t type_;
    link::Descriptor socket_;
    Address address_{};
    Description description_;
    std::uint32_t mtu_ = max_payload;
    Count sent_{0};
    Count sent_bytes_{0};
    Count received_{0};
    Count received_bytes_{0};
    link::DropCounter drops_;  // used by the receiving thread
    Count lost_{0};
    Count dropped_{0};
    Count late_{0};

    Count errors_{0};
    Count downs_{0};
    std::atomic<bool> up_{true};
    std::atomic<std::int64_t> last_sent_ns_{0};
    std::array<Peer, max_peers> peers_;
    std::array<std::uint8_t, max_frame> frame_{};  ///< used by the receiving thread
};

}  // namespace

namespace udp {

Description describe(const std::string& target) {
    return {.address = "udp:" + target,
            .transport = "frames in UDP datagrams",
            .interface = target,
            .datagrams = true};
}

Opened open(const std::string& target, const Options& options) {
    if (options.types.size() != 1) {
        return {nullptr,
                "UDP datagrams carry frames of one type only; write eth:enp3s0 or sim:NAME"};
    }
    const auto colon = std::min(target.find(':'), target.size());
    const std::string host = target.substr(0, colon);

    const std::string port = target.substr(std::min(colon + 1, target.size()));
    if (host.empty()) {
        return {nullptr, "missing host; write udp:127.0.0.1 for this machine"};
    }
    unsigned number = options.types.front();
    const bool valid_port =
        colon == target.size() || (parse_whole(port, number) && number != 0 && number <= 65535);
    if (!valid_port) {
        return {nullptr, "invalid port '" + port + "'; write udp:" + host + ":" +
                             std::to_string(options.types.front())};
    }
    addrinfo wanted{}, *found = nullptr;
    wanted.ai_family = AF_INET;
    wanted.ai_socktype = SOCK_DGRAM;
    if (const int wrong = getaddrinfo(host.c_str(), nullptr, &wanted, &found); wrong != 0) {
        return {nullptr, "no IPv4 address for host '" + host + "': " + gai_strerror(wrong) +
                             "; write an address, as in udp:127.0.0.1"};
    }
    sockaddr_in at{};
    std::memcpy(&at, found->ai_addr, std::min<std::size_t>(found->ai_addrlen, sizeof at));
    freeaddrinfo(found);
    at.sin_port = htons(static_cast<std::uint16_t>(number));
    auto opened = std::make_unique<UdpPort>(target, options, options.types.front());
    auto problem = opened->open(host, at);
    if (!problem.empty()) {
        return {nullptr, std::move(problem)};
    }
    return {std::move(opened), {}};
}

}  // namespace udp

}  // namespace hal::ethernet
