// SPDX-License-Identifier: MIT
#include "tap.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <linux/if_tun.h>
#include <net/if.h>
#include <net/if_arp.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <thread>

#include "hal/message_log.hpp"
#include "hal/privilege.hpp"
#include "link/system.hpp"

namespace hal::tdma {

namespace {

// The cycle cannot wake a thread without a system call, so the thread polls, faster while packets pass.
constexpr int         busy_ms = 1, idle_ms = 5;
constexpr Time        busy_for = 200'000'000;
constexpr std::size_t at_once = 64;  // packets in one direction before the other is served

bool is_denied(int error) { return error == EPERM || error == EACCES; }

std::string prefixed(const TapSetup& s) { return config::to_string(*s.ip) + "/" + std::to_string(s.prefix); }

class TapDevice final : public Tap {
public:
    TapDevice(Tunnel& tunnel, TapSetup setup, std::string instance)
        : tunnel_(tunnel), setup_(std::move(setup)), log_(std::move(instance)) {}
    ~TapDevice() override {
        ended_.store(true);
        if (thread_.joinable()) thread_.join();
    }
    const std::string& name() const noexcept override { return name_; }
    void scheduled(const std::optional<config::Ip>& ip, std::size_t mtu) noexcept override {
        news_.store(valid | (ip ? has_ip | std::bit_cast<std::uint32_t>(*ip) : 0) | std::uint64_t{mtu} << 34, std::memory_order_release);
    }

    /// Opens the interface. Returns the reason of a failure. [setup]
    std::string open() {
        if (auto problem = open_device(); !problem.empty()) return problem;
        socket_ = link::Descriptor(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
        if (!socket_) return "cannot configure interface " + name_ + ": " + link::reason();
        shown_mtu_ = tunnel_.mtu();
        if (auto problem = set_up(); !problem.empty()) return problem;
        show_carrier(false);
        thread_ = std::thread([this] { run(); });
        return {};
    }

private:
    static constexpr std::uint64_t valid = std::uint64_t{1} << 32, has_ip = std::uint64_t{1} << 33;  // MTU above these bits, IP below

    std::string open_device() {
        constexpr const char* device = "/dev/net/tun";
        device_ = link::Descriptor(::open(device, O_RDWR | O_NONBLOCK | O_CLOEXEC));
        if (!device_) {
            const int error = errno;
            if (is_denied(error))
                return std::string("permission denied for ") + device + ": " + link::reason(error) + "; type: sudo chmod 666 " + device;
            return std::string("missing ") + device + " (" + link::reason(error) +
                   "); type: sudo modprobe tun, or for a container add: --device " + device;
        }
        ifreq request{};
        setup_.name.copy(request.ifr_name, IFNAMSIZ - 1);
        request.ifr_flags = IFF_TAP | IFF_NO_PI;
        if (ioctl(device_.get(), TUNSETIFF, &request) != 0) {
            const int  error = errno;
            const bool there = if_nametoindex(setup_.name.c_str()) != 0;
            if (error == EBUSY) return "interface " + setup_.name + " is in use by another process; use another name, for example hal%d";
            if (there && error == EINVAL)
                return "interface " + setup_.name + " exists, but is not a TAP interface; use another name, for example hal%d";
            if (is_denied(error) && there) return "interface " + setup_.name + " belongs to another user; " + by_hand();
            if (is_denied(error))
                return "interface " + setup_.name +
                       " needs the capability CAP_NET_ADMIN; grant it with: " + grant_command(true) + "; or " + by_hand();
            return "cannot create interface " + setup_.name + ": " + link::reason(error);
        }
        name_ = request.ifr_name;
        return {};
    }

    /// Returns the commands with which an administrator creates the interface for an unprivileged user.
    std::string by_hand() const {
        const std::string mtu = tunnel_.mtu() != 0 ? std::to_string(tunnel_.mtu()) : "BYTES";  // size of slot 1 minus 4
        std::string text = "create it once: sudo ip tuntap add dev " + setup_.name + " mode tap user $USER; sudo ip link set " +
                           setup_.name + " address " + ethernet::to_string(setup_.address) + " mtu " + mtu + " up";
        if (setup_.ip) text += "; sudo ip addr add " + prefixed(setup_) + " dev " + setup_.name;
        return text;
    }

    bool ask(unsigned long what, ifreq& request) const noexcept {
        name_.copy(request.ifr_name, IFNAMSIZ - 1);
        return ioctl(socket_.get(), what, &request) == 0;
    }
    static in_addr& ip_of(ifreq& request) noexcept {
        request.ifr_addr.sa_family = AF_INET;
        return reinterpret_cast<sockaddr_in*>(&request.ifr_addr)->sin_addr;
    }

    /// Changes only what differs, so that an interface created by an administrator is used without privileges.
    std::string set_up() {
        ifreq now{};
        if (!ask(SIOCGIFHWADDR, now)) return "cannot query interface " + name_ + ": " + link::reason();
        if (!std::equal(setup_.address.begin(), setup_.address.end(), reinterpret_cast<const std::uint8_t*>(now.ifr_hwaddr.sa_data))) {
            now.ifr_hwaddr.sa_family = ARPHRD_ETHER;
            std::copy(setup_.address.begin(), setup_.address.end(), reinterpret_cast<std::uint8_t*>(now.ifr_hwaddr.sa_data));
            if (!ask(SIOCSIFHWADDR, now)) return cannot_set("address " + ethernet::to_string(setup_.address));
        }
        if (!set_mtu(shown_mtu_)) return cannot_set("MTU " + std::to_string(shown_mtu_));
        if (auto problem = set_ip(); !problem.empty()) return problem;
        ifreq flags{};
        if (!ask(SIOCGIFFLAGS, flags)) return "cannot query interface " + name_ + ": " + link::reason();
        if ((flags.ifr_flags & IFF_UP) == 0) {
            flags.ifr_flags = static_cast<short>(flags.ifr_flags | IFF_UP);
            if (!ask(SIOCSIFFLAGS, flags)) return cannot_set("state up");
        }
        return {};
    }
    std::string set_ip() {
        if (setup_.ip) {
            const std::uint32_t mask = htonl(setup_.prefix == 0 ? 0 : ~std::uint32_t{0} << (32 - setup_.prefix));
            const auto          wanted = std::bit_cast<std::uint32_t>(*setup_.ip);
            ifreq               ip{}, net{};
            const bool same = ask(SIOCGIFADDR, ip) && ip_of(ip).s_addr == wanted && ask(SIOCGIFNETMASK, net) && ip_of(net).s_addr == mask;
            ip = {}, net = {};
            ip_of(ip).s_addr = wanted, ip_of(net).s_addr = mask;
            if (!same && (!ask(SIOCSIFADDR, ip) || !ask(SIOCSIFNETMASK, net))) return cannot_set("IP " + prefixed(setup_));
        }
        return {};
    }
    /// Uses a schedule received by RTcfg.
    void apply(std::uint64_t news) {
        const std::size_t mtu = news >> 34;
        if ((news & has_ip) != 0) {
            setup_.ip = std::bit_cast<config::Ip>(static_cast<std::uint32_t>(news));
            if (const auto problem = set_ip(); !problem.empty()) log(problem);
        }
        if (mtu == 0)
            log("tunnel: ordinary packets use slot 1, and the block of this station has none; add slot 1 OFFSET to it in the "
                "master's file");
        else
            log("tunnel open for ordinary packets: " + name_ + ", MTU " + std::to_string(mtu) +
                (setup_.ip ? ", IP " + config::to_string(*setup_.ip) : ""));
    }
    std::string cannot_set(const std::string& what) const {
        const int error = errno;
        return "cannot set " + what + " of interface " + name_ + ": " + link::reason(error) + (is_denied(error) ? "; " + by_hand() : "");
    }
    bool set_mtu(std::size_t mtu) const noexcept {
        ifreq now{};
        if (mtu == 0 || (ask(SIOCGIFMTU, now) && now.ifr_mtu == static_cast<int>(mtu))) return true;
        now.ifr_mtu = static_cast<int>(mtu);
        return ask(SIOCSIFMTU, now);
    }
    void show_carrier(bool up) noexcept {
        int carrier = up ? 1 : 0;
        (void)ioctl(device_.get(), TUNSETCARRIER, &carrier);  // Linux 5.0; before that the interface always has one
        carrier_ = up;
    }
    void log(const std::string& sentence) { log_.print(sentence); }

    void run() {
        pthread_setname_np(pthread_self(), "tap");
        Time busy_until = 0;
        while (!ended_.load()) {
            if (const auto news = news_.exchange(0, std::memory_order_acquire); news != 0) apply(news);
            if (const std::size_t mtu = tunnel_.mtu(); mtu != shown_mtu_) {  // the schedule changed
                if (!set_mtu(mtu)) log(cannot_set("MTU " + std::to_string(mtu)));
                shown_mtu_ = mtu;
            }
            log_.flush();
            if (tunnel_.open() != carrier_) show_carrier(!carrier_);
            const Time now = link::monotonic_ns();
            if (write_all() + read_all() != 0) busy_until = now + busy_for;
            pollfd source{device_.get(), POLLIN, 0};
            ::poll(&source, 1, now < busy_until ? busy_ms : idle_ms);
            if ((source.revents & (POLLERR | POLLHUP | POLLNVAL)) == 0) {
                gone_ = 0;
            } else if (++gone_ == 200) {  // a transient error for a moment; later the interface is lost for this descriptor
                log("interface " + name_ + " was deleted; ordinary packets pass again after unloadrt and loadrt");
                return;
            } else {
                std::this_thread::sleep_for(std::chrono::milliseconds(idle_ms));
            }
        }
    }
    std::size_t write_all() noexcept {
        std::size_t packets = 0;
        for (std::size_t length = 0; packets < at_once && (length = tunnel_.take(buffer_)) != 0; ++packets)
            (void)!::write(device_.get(), buffer_.data(), length);  // fails while the interface is down, as on any interface
        return packets;
    }
    std::size_t read_all() noexcept {
        std::size_t packets = 0;
        for (; packets < at_once; ++packets) {
            const ssize_t length = ::read(device_.get(), buffer_.data(), buffer_.size());
            if (length <= 0) break;
            tunnel_.give({buffer_.data(), static_cast<std::size_t>(length)});
        }
        return packets;
    }

    Tunnel&                                               tunnel_;
    TapSetup                                              setup_;  // its IP is owned by the thread while that runs
    hal::MessageLog                                       log_;
    std::string                                           name_;
    link::Descriptor                                       device_, socket_;
    std::size_t                                           shown_mtu_ = 0;
    bool                                                  carrier_ = false;
    unsigned                                              gone_ = 0;
    std::array<std::uint8_t, ethernet::largest_frame + 4> buffer_{};  // space for a VLAN tag, so that such a frame is counted
    std::atomic<std::uint64_t>                            news_{0};  // written by the cycle, taken by the thread; 0: none
    std::atomic<bool>                                     ended_{false};
    std::thread                                           thread_;
};

}  // namespace

OpenedTap open_tap(Tunnel& tunnel, const TapSetup& setup, const std::string& instance) {
    if (auto problem = wrong_name(setup.name); !problem.empty()) return {nullptr, std::move(problem)};
    auto tap = std::make_unique<TapDevice>(tunnel, setup, instance);
    if (auto problem = tap->open(); !problem.empty()) return {nullptr, std::move(problem)};
    return {std::move(tap), {}};
}

std::string wrong_name(std::string_view name) {
    const std::size_t percent = name.find('%');
    const bool        number = percent != name.npos && name.substr(percent, 2) == "%d" && name.find('%', percent + 2) == name.npos;
    const bool        letters = std::all_of(name.begin(), name.end(), [](char c) { return c > ' ' && c < 127 && c != '/' && c != ':'; });
    if (!name.empty() && name.size() < IFNAMSIZ && letters && (percent == name.npos || number) && name != "." && name != "..") return {};
    return "'" + std::string(name) +
           "' is not a valid interface name; use at most 15 letters and digits, for example hal0, or hal%d for the first free number";
}

std::optional<unsigned> parse_prefix(std::string_view text) {
    if (const auto mask = config::parse_ip(text)) {
        const std::uint32_t bits = ntohl(std::bit_cast<std::uint32_t>(*mask));
        if (std::countl_one(bits) + std::countr_zero(bits) < 32) return {};
        return static_cast<unsigned>(std::countl_one(bits));
    }
    unsigned bits = 0;
    const auto [end, wrong] = std::from_chars(text.data(), text.data() + text.size(), bits);
    if (wrong != std::errc{} || end != text.data() + text.size() || bits > 32) return {};
    return bits;
}

}  // namespace hal::tdma
