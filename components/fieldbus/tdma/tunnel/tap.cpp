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

// The cycle cannot wake a thread without a call into the kernel, so the thread looks by itself, more often while packets come.
constexpr int         busy_ms = 1, idle_ms = 5;
constexpr Time        busy_for = 200'000'000;
constexpr std::size_t at_once = 64;  // packets one way, until it looks the other way

bool is_refusal(int error) { return error == EPERM || error == EACCES; }

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
        news_.store(came | (ip ? has_ip | std::bit_cast<std::uint32_t>(*ip) : 0) | std::uint64_t{mtu} << 34, std::memory_order_release);
    }

    /// What is wrong, or nothing. [setup]
    std::string open() {
        if (auto problem = open_device(); !problem.empty()) return problem;
        socket_ = link::Descriptor(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
        if (!socket_) return name_ + " cannot be set up: " + link::reason();
        shown_mtu_ = tunnel_.mtu();
        if (auto problem = set_up(); !problem.empty()) return problem;
        show_carrier(false);
        thread_ = std::thread([this] { run(); });
        return {};
    }

private:
    static constexpr std::uint64_t came = std::uint64_t{1} << 32, has_ip = std::uint64_t{1} << 33;  // above these the MTU, below the IP

    std::string open_device() {
        constexpr const char* device = "/dev/net/tun";
        device_ = link::Descriptor(::open(device, O_RDWR | O_NONBLOCK | O_CLOEXEC));
        if (!device_) {
            const int error = errno;
            if (is_refusal(error)) return std::string(device) + " may not be opened: " + link::reason(error) + "; sudo chmod 666 " + device;
            return std::string("this machine has no ") + device + " (" + link::reason(error) +
                   "); sudo modprobe tun, or for a container: --device " + device;
        }
        ifreq request{};
        setup_.name.copy(request.ifr_name, IFNAMSIZ - 1);
        request.ifr_flags = IFF_TAP | IFF_NO_PI;
        if (ioctl(device_.get(), TUNSETIFF, &request) != 0) {
            const int  error = errno;
            const bool there = if_nametoindex(setup_.name.c_str()) != 0;
            if (error == EBUSY) return "the interface " + setup_.name + " is another process's; give this one another name, as in hal%d";
            if (there && error == EINVAL)
                return setup_.name + " is another interface's name, and that is no TAP; give this one another name, as in hal%d";
            if (is_refusal(error) && there) return "the interface " + setup_.name + " is another user's; " + by_hand();
            if (is_refusal(error))
                return "the interface " + setup_.name +
                       " needs the capability CAP_NET_ADMIN; grant it with: " + grant_command(true) + "; or " + by_hand();
            return "the interface " + setup_.name + " cannot be made: " + link::reason(error);
        }
        name_ = request.ifr_name;
        return {};
    }

    /// What a user without the right to it lets somebody else type once.
    std::string by_hand() const {
        const std::string mtu = tunnel_.mtu() != 0 ? std::to_string(tunnel_.mtu()) : "BYTES";  // of slot 1 less 4, once there is a schedule
        std::string text = "make it once: sudo ip tuntap add dev " + setup_.name + " mode tap user $USER; sudo ip link set " + setup_.name +
                           " address " + ethernet::to_string(setup_.address) + " mtu " + mtu + " up";
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

    /// Sets only what is not so already: an interface that somebody else made is used without the right to change one.
    std::string set_up() {
        ifreq now{};
        if (!ask(SIOCGIFHWADDR, now)) return name_ + " cannot be asked: " + link::reason();
        if (!std::equal(setup_.address.begin(), setup_.address.end(), reinterpret_cast<const std::uint8_t*>(now.ifr_hwaddr.sa_data))) {
            now.ifr_hwaddr.sa_family = ARPHRD_ETHER;
            std::copy(setup_.address.begin(), setup_.address.end(), reinterpret_cast<std::uint8_t*>(now.ifr_hwaddr.sa_data));
            if (!ask(SIOCSIFHWADDR, now)) return refused("the address " + ethernet::to_string(setup_.address));
        }
        if (!set_mtu(shown_mtu_)) return refused("an MTU of " + std::to_string(shown_mtu_));
        if (auto problem = set_ip(); !problem.empty()) return problem;
        ifreq flags{};
        if (!ask(SIOCGIFFLAGS, flags)) return name_ + " cannot be asked: " + link::reason();
        if ((flags.ifr_flags & IFF_UP) == 0) {
            flags.ifr_flags = static_cast<short>(flags.ifr_flags | IFF_UP);
            if (!ask(SIOCSIFFLAGS, flags)) return refused("up");
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
            if (!same && (!ask(SIOCSIFADDR, ip) || !ask(SIOCSIFNETMASK, net))) return refused("the IP " + prefixed(setup_));
        }
        return {};
    }
    /// What RTcfg brought.
    void take(std::uint64_t news) {
        const std::size_t mtu = news >> 34;
        if ((news & has_ip) != 0) {
            setup_.ip = std::bit_cast<config::Ip>(static_cast<std::uint32_t>(news));
            if (const auto problem = set_ip(); !problem.empty()) say(problem);
        }
        if (mtu == 0)
            say("tunnel: ordinary packets leave in slot 1, and this station's block has none; write slot 1 OFFSET into it, in the file "
                "of the master");
        else
            say("ordinary packets pass by " + name_ + ", MTU " + std::to_string(mtu) +
                (setup_.ip ? ", IP " + config::to_string(*setup_.ip) : ""));
    }
    std::string refused(const std::string& what) const {
        const int error = errno;
        return name_ + " cannot be given " + what + ": " + link::reason(error) + (is_refusal(error) ? "; " + by_hand() : "");
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
    void say(const std::string& sentence) { log_.print(sentence); }

    void run() {
        pthread_setname_np(pthread_self(), "tap");
        Time busy_until = 0;
        while (!ended_.load()) {
            if (const auto news = news_.exchange(0, std::memory_order_acquire); news != 0) take(news);
            if (const std::size_t mtu = tunnel_.mtu(); mtu != shown_mtu_) {  // another schedule came
                if (!set_mtu(mtu)) say(refused("an MTU of " + std::to_string(mtu)));
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
            } else if (++gone_ == 200) {  // for a moment it may be anything; then nobody brings it back under this descriptor
                say("the interface " + name_ + " was deleted; ordinary packets pass again after unloadrt and loadrt");
                return;
            } else {
                std::this_thread::sleep_for(std::chrono::milliseconds(idle_ms));
            }
        }
    }
    std::size_t write_all() noexcept {
        std::size_t packets = 0;
        for (std::size_t length = 0; packets < at_once && (length = tunnel_.take(buffer_)) != 0; ++packets)
            (void)!::write(device_.get(), buffer_.data(), length);  // refused while somebody has it down: as on any interface
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
    TapSetup                                              setup_;  // its IP is the thread's, once that runs
    hal::MessageLog                                       log_;
    std::string                                           name_;
    link::Descriptor                                       device_, socket_;
    std::size_t                                           shown_mtu_ = 0;
    bool                                                  carrier_ = false;
    unsigned                                              gone_ = 0;
    std::array<std::uint8_t, ethernet::largest_frame + 4> buffer_{};  // one with a VLAN tag is read whole, to be counted
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
           "' is no name of an interface: at most 15 letters and digits, as in hal0, or hal%d for the first that is free";
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
