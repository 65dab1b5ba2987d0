// SPDX-License-Identifier: MIT
#include "inspect/round_trip.hpp"

#include <algorithm>
#include <arpa/inet.h>
#include <array>
#include <cerrno>
#include <cstring>
#include <fmt/core.h>
#include <fstream>
#include <linux/if_packet.h>
#include <net/if.h>
#include <poll.h>
#include <pthread.h>
#include <sstream>
#include <sys/socket.h>
#include <thread>
#include <unistd.h>
#include <vector>

#include "execute/core.hpp"
#include "execute/wait.hpp"
#include "hal/privilege.hpp"

namespace hal::tools {

namespace {

constexpr std::uint16_t ethercat_type = 0x88a4;
constexpr std::int64_t period_ns = 1'000'000;
constexpr std::int64_t timeout_ns = 20'000'000;
constexpr std::size_t counter_at = 17;  // of the datagram's index in the frame
constexpr std::uint64_t needed_answers = 20;

using Frame = std::array<std::uint8_t, 60>;

/// A frame with one BRD of 2 bytes from register 0: 14 bytes of Ethernet header, 2 of EtherCAT's,
/// 10 of the datagram's, data, working counter, padding.
Frame broadcast_read() {
    Frame frame{};
    std::fill_n(frame.begin(), 6, 0xff);
    frame[6] = 0x02;  // a locally administered source, which slaves may change
    frame[12] = ethercat_type >> 8;
    frame[13] = ethercat_type & 0xff;
    frame[14] = 14;         // length of the datagram
    frame[15] = 1 << 4;     // type: datagrams
    frame[16] = 7;          // BRD
    frame[22] = 2;          // length of the data
    return frame;
}

/// Receives until the frame with this index is back, or until the timeout. Returns when it was
/// back, or 0. It sleeps: a real-time thread that polls would keep an emulated line from its CPU.
std::int64_t wait_for(int socket, std::uint8_t index, std::int64_t sent_ns) {
    std::array<std::uint8_t, 1514> bytes{};
    std::int64_t passed_ns = 0;
    while ((passed_ns = monotonic_ns() - sent_ns) < timeout_ns) {
        pollfd waiting{socket, POLLIN, 0};
        ::poll(&waiting, 1, static_cast<int>((timeout_ns - passed_ns) / 1'000'000) + 1);
        const ssize_t length = ::recv(socket, bytes.data(), bytes.size(), MSG_DONTWAIT);
        if (length > static_cast<ssize_t>(counter_at) && bytes[16] == 7 &&
            bytes[counter_at] == index) {
            return monotonic_ns();
        }
    }
    return 0;
}

/// Returns a socket for EtherCAT frames of the interface, or -1 and the reason.
int open_socket(const std::string& interface, std::string& problem) {
    const int socket = ::socket(AF_PACKET, SOCK_RAW | SOCK_CLOEXEC, htons(ethercat_type));
    if (socket < 0) {
        problem = errno == EPERM || errno == EACCES
                      ? "raw frames are denied; type: " + grant_command()
                      : fmt::format("no packet socket: {}", std::strerror(errno));
        return -1;
    }
    sockaddr_ll address{};
    address.sll_family = AF_PACKET;
    address.sll_protocol = htons(ethercat_type);
    address.sll_ifindex = static_cast<int>(::if_nametoindex(interface.c_str()));
    if (::bind(socket, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0) return socket;
    problem = fmt::format("cannot use {}: {}", interface, std::strerror(errno));
    ::close(socket);
    return -1;
}

class Measurement {
public:
    Measurement(const std::string& interface, const std::function<bool()>& stopped)
        : interface_(interface), stopped_(stopped) {}

    RoundTrip run(int socket, std::int64_t duration_ns) {
        Frame frame = broadcast_read();
        const std::int64_t start = monotonic_ns();
        for (std::int64_t due = start; due < start + duration_ns && !stopped_(); due += period_ns) {
            Wait{0}.sleep(due);
            ++frame[counter_at];
            const std::int64_t sent = monotonic_ns();
            if (::send(socket, frame.data(), frame.size(), 0) < 0) {
                result_.problem = fmt::format("cannot send: {}", std::strerror(errno));
                return result_;
            }
            ++result_.frames;
            const std::int64_t back = wait_for(socket, frame[counter_at], sent);
            if (back == 0) {
                ++result_.lost;
            } else {
                times_.push_back(back - sent);
            }
            if (result_.lost == needed_answers && times_.empty()) break;
            due = std::max(due, monotonic_ns() - period_ns);
        }
        evaluate();
        return result_;
    }

private:
    void evaluate() {
        if (times_.empty()) {
            result_.problem = "no frame returns on " + interface_ +
                              ": connect and switch on the slaves, or emulate some at the other "
                              "end: hal node ethercat FILE --link eth:INTERFACE";
            return;
        }
        std::sort(times_.begin(), times_.end());
        const auto quantile = [&](double part) {
            const auto last = static_cast<double>(times_.size() - 1);
            return static_cast<double>(times_[static_cast<std::size_t>(part * last)]);
        };
        result_.p50_ns = quantile(0.5);
        result_.p99_ns = quantile(0.99);
        result_.max_ns = quantile(1.0);
    }

    const std::string& interface_;
    const std::function<bool()>& stopped_;
    std::vector<std::int64_t> times_;
    RoundTrip result_;
};

}  // namespace

RoundTrip measure_round_trip(const std::string& interface, std::int64_t duration_ns,
                             const std::function<bool()>& stopped) {
    RoundTrip result;
    const int socket = open_socket(interface, result.problem);
    if (socket < 0) return result;
    std::thread([&] {
        sched_param wanted{};
        wanted.sched_priority = 98;
        ::pthread_setschedparam(::pthread_self(), SCHED_FIFO, &wanted);  // where it is permitted
        result = Measurement(interface, stopped).run(socket, duration_ns);
    }).join();
    ::close(socket);
    return result;
}

bool has_ethercat_user(const std::string& interface) {
    // sk RefCnt Type Proto Iface R Rmem User Inode
    const unsigned index = ::if_nametoindex(interface.c_str());
    std::ifstream sockets("/proc/net/packet");
    std::string line;
    std::getline(sockets, line);
    while (std::getline(sockets, line)) {
        std::istringstream words(line);
        std::string socket;
        std::string references;
        std::string type;
        std::string protocol;
        unsigned bound = 0;
        words >> socket >> references >> type >> protocol >> bound;
        if (protocol == "88a4" && bound == index) return true;
    }
    return false;
}

}  // namespace hal::tools
