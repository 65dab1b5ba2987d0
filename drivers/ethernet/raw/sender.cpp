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
    constexpr std::int64_t min_lead = 4'000;
    static constexpr std::array<std::uint8_t, header_bytes - 1> runt{};
    auto now = link::monotonic_ns();
    const bool is_cold = time_ns - last_ns_.load(std::memory_order_relaxed) > cold_after;
    if (time_ns - now > min_lead && is_cold) {
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

namespace {

void write_big_endian(std::uint8_t* to, std::uint64_t value) noexcept {
    for (int i = 8; i-- > 0; value >>= 8) {
        to[i] = static_cast<std::uint8_t>(value);
    }
}

/// A frame as it is sent: padded, and in a buffer of its own when it is changed at launch.
class Outgoing {
public:
    /// Returns false for a frame that is too long to be changed.
    bool adopt(std::span<const std::uint8_t> frame, bool changes) noexcept {
        length_ = frame.size();
        bytes_ = frame;
        if (length_ < smallest_frame) {
            std::memcpy(buffer_.data(), frame.data(), length_);
            std::memset(buffer_.data() + length_, 0, smallest_frame - length_);
            bytes_ = {buffer_.data(), smallest_frame};
            return true;
        }
        if (!changes) return true;
        if (length_ > buffer_.size()) return false;
        std::memcpy(buffer_.data(), frame.data(), length_);
        bytes_ = {buffer_.data(), length_};
        return true;
    }
    /// Returns what is sent.
    std::span<const std::uint8_t> bytes() const noexcept { return bytes_; }
    /// Returns the frame without padding, in the buffer.
    std::span<std::uint8_t> content() noexcept { return {buffer_.data(), length_}; }

private:
    std::span<const std::uint8_t> bytes_;
    std::size_t length_ = 0;
    std::array<std::uint8_t, max_frame> buffer_;
};

bool is_gone(int error) noexcept { return error == ENETDOWN || error == ENXIO || error == ENODEV; }

}  // namespace

/// Gives the bytes to the kernel. Returns 0 or errno.
int Sender::transmit(std::span<const std::uint8_t> bytes) noexcept {
    bool retried = false;
    for (;;) {
        if (::send(socket_.get(), bytes.data(), bytes.size(), MSG_DONTWAIT) >= 0) return 0;
        if (errno == EINTR) continue;
        if (errno != ENETDOWN || retried) return errno;
        retried = true;  // a stale error
    }
}

/// Notes how far from its launch time a frame left.
void Sender::measure(const Launch& launch, std::int64_t now_ns) noexcept {
    if (launch.at_ns != 0) {
        launch_error_ns.store(now_ns - launch.at_ns, std::memory_order_relaxed);
    }
    if (!transmit_stamps_) return;
    read_stamps();
    const auto left = departure_ns.load(std::memory_order_relaxed);
    if (launch.at_ns != 0 && left >= now_ns) {
        launch_error_ns.store(left - launch.at_ns, std::memory_order_relaxed);
    }
}

Sent Sender::leave(std::span<const std::uint8_t> frame, const Launch& launch) noexcept {
    const bool stamped = launch.stamp_at != 0;
    const bool finished = launch.finisher != nullptr;
    Outgoing outgoing;
    if (!outgoing.adopt(frame, stamped || finished)) return drop(Sent::rejected);
    std::int64_t now = 0;
    if (launch.at_ns != 0 || stamped) {
        now = link::monotonic_ns();
        if (launch.is_late(now)) return drop(Sent::late);
    }
    if (stamped) {
        write_big_endian(outgoing.content().data() + launch.stamp_at,
                         static_cast<std::uint64_t>(now + launch.stamp_add_ns));
    }
    if (finished) {
        launch.finisher->leaves(outgoing.content());
    }
    if (const int error = transmit(outgoing.bytes()); error != 0) {
        if (finished) {
            launch.finisher->stayed(outgoing.content());
        }
        errors.fetch_add(1, std::memory_order_relaxed);
        dropped.fetch_add(1, std::memory_order_relaxed);
        if (is_gone(error)) return Sent::down;
        return error == EMSGSIZE ? Sent::rejected : Sent::full;
    }
    if (now != 0) {
        last_ns_.store(now, std::memory_order_relaxed);
    }
    sent.fetch_add(1, std::memory_order_relaxed);
    sent_bytes.fetch_add(outgoing.bytes().size(), std::memory_order_relaxed);
    measure(launch, now);
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
