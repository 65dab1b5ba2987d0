// SPDX-License-Identifier: MIT
#include "sender.hpp"

#include <linux/errqueue.h>
#include <linux/if_packet.h>
#include <linux/net_tstamp.h>
#include <sys/socket.h>

#include <cstring>

namespace hal::ethernet::rawether {

std::string Sender::open(bool transmit_stamps) {
    // protocol 0: receives nothing
    socket_ = link::Descriptor(::socket(AF_PACKET, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
    if (!socket_) return link::reason();
    const int yes = 1;
    const int stamps =
        SOF_TIMESTAMPING_TX_SOFTWARE | SOF_TIMESTAMPING_SOFTWARE | SOF_TIMESTAMPING_OPT_TSONLY;
    setsockopt(socket_.get(), SOL_PACKET, PACKET_QDISC_BYPASS, &yes, sizeof yes);
    transmit_stamps_ = transmit_stamps && setsockopt(socket_.get(), SOL_SOCKET, SO_TIMESTAMPING,
                                                     &stamps, sizeof stamps) == 0;
    return {};
}

bool Sender::bind(int index) noexcept {
    sockaddr_ll address{};
    address.sll_family = AF_PACKET;
    address.sll_ifindex = index;
    return ::bind(socket_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
}

void Sender::await(std::int64_t time_ns) noexcept {
    constexpr std::int64_t cold_after = 30'000;
    constexpr std::int64_t ahead = 8'000;
    constexpr std::int64_t least = 4'000;
    static constexpr std::array<std::uint8_t, header_bytes - 1> runt{};
    auto now = link::monotonic_ns();
    if (time_ns - now > least && time_ns - last_ns_.load(std::memory_order_relaxed) > cold_after) {
        for (; now < time_ns - ahead; now = link::monotonic_ns()) {
            pause_processor();
        }
        (void)!::send(socket_.get(), runt.data(), runt.size(), MSG_DONTWAIT);
    }
    while (link::monotonic_ns() < time_ns) {
        pause_processor();
    }
}

Sent Sender::drop(Sent why) noexcept {
    (why == Sent::late ? late : dropped).fetch_add(1, std::memory_order_relaxed);
    if (why == Sent::rejected) {
        errors.fetch_add(1, std::memory_order_relaxed);
    }
    return why;
}

Sent Sender::leave(std::span<const std::uint8_t> frame, const Launch& launch) noexcept {
    std::array<std::uint8_t, smallest_frame> small{};
    std::array<std::uint8_t, largest_frame> large;
    const auto length = frame.size();
    if (length < smallest_frame) {
        std::memcpy(small.data(), frame.data(), length);
        frame = small;
    } else if (launch.stamp_at != 0 || launch.finisher != nullptr) {
        if (frame.size() > large.size()) return drop(Sent::rejected);
        std::memcpy(large.data(), frame.data(), frame.size());
        frame = {large.data(), frame.size()};
    }
    std::int64_t now = 0;
    if (launch.at_ns != 0 || launch.stamp_at != 0) {
        now = link::monotonic_ns();
        if (launch.is_late(now)) return drop(Sent::late);
    }
    auto* const own = frame.data() == small.data() ? small.data() : large.data();
    if (launch.stamp_at != 0) {
        auto* place = own + launch.stamp_at;
        auto stamp = static_cast<std::uint64_t>(now + launch.stamp_add_ns);
        for (int i = 8; i-- > 0; stamp >>= 8) {
            place[i] = static_cast<std::uint8_t>(stamp);
        }
    }
    if (launch.finisher != nullptr) {
        launch.finisher->leaves({own, length});
    }
    for (int tries = 0;; ++tries) {
        if (::send(socket_.get(), frame.data(), frame.size(), MSG_DONTWAIT) >= 0) break;
        const int error = errno;
        if (error == EINTR) continue;
        if (error == ENETDOWN && tries == 0) {
            continue;  // a stale error
        }
        if (launch.finisher != nullptr) {
            launch.finisher->stayed({own, length});
        }
        errors.fetch_add(1, std::memory_order_relaxed);
        dropped.fetch_add(1, std::memory_order_relaxed);
        if (error == ENETDOWN || error == ENXIO || error == ENODEV) return Sent::down;
        return error == EMSGSIZE ? Sent::rejected : Sent::full;
    }
    if (now != 0) {
        last_ns_.store(now, std::memory_order_relaxed);
    }
    sent.fetch_add(1, std::memory_order_relaxed);
    sent_bytes.fetch_add(frame.size(), std::memory_order_relaxed);
    if (launch.at_ns != 0) {
        launch_error_ns.store(now - launch.at_ns, std::memory_order_relaxed);
    }
    if (transmit_stamps_) {
        read_stamps();
        if (const auto left = departure_ns.load(std::memory_order_relaxed);
            launch.at_ns != 0 && left >= now) {
            launch_error_ns.store(left - launch.at_ns, std::memory_order_relaxed);
        }
    }
    return Sent::queued;
}

/// Reads the transmit timestamps, which the kernel puts on the error queue, mostly before send()
/// returns.
void Sender::read_stamps() noexcept {
    for (int i = 0; i < 8; ++i) {
        alignas(cmsghdr) char control[256];
        msghdr message{};
        message.msg_control = control;
        message.msg_controllen = sizeof control;
        if (::recvmsg(socket_.get(), &message, MSG_ERRQUEUE | MSG_DONTWAIT) < 0) return;
        for (cmsghdr* c = CMSG_FIRSTHDR(&message); c != nullptr; c = CMSG_NXTHDR(&message, c)) {
            if (c->cmsg_level != SOL_SOCKET || c->cmsg_type != SCM_TIMESTAMPING) continue;
            scm_timestamping stamps{};
            std::memcpy(&stamps, CMSG_DATA(c), sizeof stamps);
            const auto stamp = stamps.ts[0].tv_sec * 1'000'000'000LL + stamps.ts[0].tv_nsec;
            const auto last = departure_ns.load(std::memory_order_relaxed);
            departure_ns.store(clock_.to_monotonic(stamp, last, link::monotonic_ns()),
                               std::memory_order_relaxed);
        }
    }
}

void Sender::forget() noexcept {
    int error = 0;
    socklen_t size = sizeof error;
    (void)getsockopt(socket_.get(), SOL_SOCKET, SO_ERROR, &error, &size);
}

}  // namespace hal::ethernet::rawether
