// SPDX-License-Identifier: MIT
#include "receiver.hpp"

#include <arpa/inet.h>
#include <linux/filter.h>
#include <linux/if_ether.h>
#include <linux/if_packet.h>
#include <linux/net_tstamp.h>
#include <sys/mman.h>
#include <sys/socket.h>

#include <algorithm>
#include <bit>
#include <vector>

#include "hal/privilege.hpp"

namespace hal::ethernet::rawether {

namespace {

constexpr std::size_t slot_bytes = 2048;
constexpr std::size_t block_bytes = 65536;

template <class T>
bool set(int fd, int level, int name, const T& value) {
    return setsockopt(fd, level, name, &value, sizeof value) == 0;
}

/// Builds a filter that passes frames for this station, of the given types.
std::vector<sock_filter> filter(const std::vector<std::uint16_t>& types, bool promiscuous) {
    std::vector<sock_filter> code;
    const auto add = [&](std::uint16_t what, std::uint32_t value, std::size_t when_true = 0,
                         std::size_t when_false = 0) {
        code.push_back({what, static_cast<std::uint8_t>(when_true),
                        static_cast<std::uint8_t>(when_false), value});
    };
    const auto ancillary = [](int of) { return static_cast<std::uint32_t>(SKF_AD_OFF + of); };
    if (!promiscuous) {
        add(BPF_LD | BPF_W | BPF_ABS, ancillary(SKF_AD_PKTTYPE));
        add(BPF_JMP | BPF_JEQ | BPF_K, PACKET_OTHERHOST, 0, 1);
        add(BPF_RET | BPF_K, 0);
    }
    if (!types.empty()) {
        add(BPF_LD | BPF_W | BPF_ABS, ancillary(SKF_AD_PROTOCOL));
        for (std::size_t i = 0; i < types.size(); ++i) {
            add(BPF_JMP | BPF_JEQ | BPF_K, types[i], types.size() - i, 0);
        }
        add(BPF_RET | BPF_K, 0);
    }
    add(BPF_RET | BPF_K, UINT32_MAX);
    return code;
}

}  // namespace

const std::uint32_t Receiver::user_ = TP_STATUS_USER;

Receiver::~Receiver() {
    if (memory_ != nullptr) {
        munmap(memory_, frames_ * slot_bytes);
    }
}

std::string Receiver::open(const Options& options) {
    if (options.types.size() > 64) return "more than 64 Ethertypes on one port; open several ports";
    socket_ = link::Descriptor(::socket(AF_PACKET, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
    const int refusal = socket_ ? 0 : errno;
    if (refusal == EPERM || refusal == EACCES) {
        return "raw Ethernet needs the capability CAP_NET_RAW; grant it with: " + grant_command() +
               "; to see the capabilities: hal doctor";
    }
    if (!socket_) return "cannot open a packet socket: " + link::reason(refusal);
    protocol_ = options.types.size() == 1 ? options.types[0] : std::uint16_t{ETH_P_ALL};
    promiscuous_ = options.promiscuous;
    const int yes = 1;
    const int version = TPACKET_V2;
    set(socket_.get(), SOL_PACKET, PACKET_IGNORE_OUTGOING, yes);
    // Timestamps from where the frame enters the kernel rather than this socket.
    set(socket_.get(), SOL_SOCKET, SO_TIMESTAMPING,
        int{SOF_TIMESTAMPING_RX_SOFTWARE | SOF_TIMESTAMPING_SOFTWARE});
    auto code = filter(options.types, options.promiscuous);
    if (!set(socket_.get(), SOL_SOCKET, SO_ATTACH_FILTER,
             sock_fprog{static_cast<unsigned short>(code.size()), code.data()})) {
        return "cannot attach the filter: " + link::reason();
    }
    frames_ = std::bit_ceil(std::clamp<std::size_t>(options.receive_capacity, 32, 16384));
    tpacket_req ring{};
    ring.tp_frame_size = slot_bytes;
    ring.tp_frame_nr = static_cast<unsigned>(frames_);
    ring.tp_block_size = static_cast<unsigned>(std::min(block_bytes, frames_ * slot_bytes));
    ring.tp_block_nr = static_cast<unsigned>(frames_ * slot_bytes / ring.tp_block_size);
    if (!set(socket_.get(), SOL_PACKET, PACKET_VERSION, version) ||
        !set(socket_.get(), SOL_PACKET, PACKET_RX_RING, ring)) {
        return "cannot create the receive ring: " + link::reason() +
               "; try a smaller one: ?receivequeue=64";
    }
    void* memory = mmap(nullptr, frames_ * slot_bytes, PROT_READ | PROT_WRITE,
                        MAP_SHARED | MAP_POPULATE, socket_.get(), 0);
    if (memory == MAP_FAILED) return "cannot map the receive ring: " + link::reason();
    memory_ = static_cast<std::uint8_t*>(memory);
    return {};
}

bool Receiver::bind(int index) noexcept {
    sockaddr_ll address{};
    address.sll_family = AF_PACKET;
    address.sll_protocol = htons(protocol_);
    address.sll_ifindex = index;
    if (::bind(socket_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
        return false;
    }
    if (!promiscuous_) return true;
    packet_mreq membership{};
    membership.mr_ifindex = index;
    membership.mr_type = PACKET_MR_PROMISC;
    return set(socket_.get(), SOL_PACKET, PACKET_ADD_MEMBERSHIP, membership);
}

std::atomic_ref<std::uint32_t> Receiver::status(std::size_t frame) noexcept {
    return std::atomic_ref(
        reinterpret_cast<tpacket2_hdr*>(memory_ + frame * slot_bytes)->tp_status);
}

void Receiver::release() noexcept {
    if (!held_) return;
    held_ = false;
    status((next_ - 1) & (frames_ - 1)).store(TP_STATUS_KERNEL, std::memory_order_release);
}

std::optional<Arrival> Receiver::next(RealTime& clock) noexcept {
    while (ready()) {
        std::uint8_t* const slot = memory_ + next_ * slot_bytes;
        const auto& header = *reinterpret_cast<const tpacket2_hdr*>(slot);
        next_ = (next_ + 1) & (frames_ - 1);
        held_ = true;
        if (header.tp_len != header.tp_snaplen || header.tp_snaplen < header_bytes ||
            header.tp_mac + header.tp_snaplen > slot_bytes) {
            errors.fetch_add(1, std::memory_order_relaxed);
            continue;
        }
        received.fetch_add(1, std::memory_order_relaxed);
        received_bytes.fetch_add(header.tp_snaplen, std::memory_order_relaxed);
        const auto stamp = header.tp_sec * std::int64_t{1'000'000'000} + header.tp_nsec;
        last_ns_ = clock.to_monotonic(stamp, last_ns_, link::monotonic_ns());
        return Arrival{{slot + header.tp_mac, header.tp_snaplen}, last_ns_};
    }
    return std::nullopt;
}

std::uint64_t Receiver::lost() noexcept {
    tpacket_stats counts{};
    socklen_t size = sizeof counts;
    return getsockopt(socket_.get(), SOL_PACKET, PACKET_STATISTICS, &counts, &size) == 0
               ? counts.tp_drops
               : 0;
}

}  // namespace hal::ethernet::rawether
