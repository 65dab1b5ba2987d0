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

#include "hal/privilege.hpp"

namespace hal::tap {

namespace {

bool is_denied(int error) { return error == EPERM || error == EACCES; }

bool ask(const link::Descriptor& socket, const std::string& name, unsigned long what,
         ifreq& request) noexcept {
    name.copy(request.ifr_name, IFNAMSIZ - 1);
    return ioctl(socket.get(), what, &request) == 0;
}

in_addr& ip_of(ifreq& request) noexcept {
    request.ifr_addr.sa_family = AF_INET;
    return reinterpret_cast<sockaddr_in*>(&request.ifr_addr)->sin_addr;
}

std::string prefixed(const Setup& s) { return to_string(*s.ip) + "/" + std::to_string(s.prefix); }

}  // namespace

std::string Interface::open(const Setup& setup) {
    setup_ = setup;
    if (auto problem = wrong_name(setup.name); !problem.empty()) return problem;
    if (auto problem = open_device(); !problem.empty()) return problem;
    socket_ = link::Descriptor(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
    if (!socket_) return "cannot configure interface " + name_ + ": " + link::reason();
    if (auto problem = apply_address(); !problem.empty()) return problem;
    if (auto problem = apply_mtu(); !problem.empty()) return problem;
    if (auto problem = apply_ip(); !problem.empty()) return problem;
    return bring_up();
}

std::string Interface::open_device() {
    constexpr const char* device = "/dev/net/tun";
    device_ = link::Descriptor(::open(device, O_RDWR | O_NONBLOCK | O_CLOEXEC));
    if (!device_) {
        const int error = errno;
        if (is_denied(error)) {
            return std::string("permission denied for ") + device + ": " + link::reason(error) +
                   "; type: sudo chmod 666 " + device;
        }
        return std::string("missing ") + device + " (" + link::reason(error) +
               "); type: sudo modprobe tun, or for a container add: --device " + device;
    }
    ifreq request{};
    setup_.name.copy(request.ifr_name, IFNAMSIZ - 1);
    request.ifr_flags = IFF_TAP | IFF_NO_PI;
    if (ioctl(device_.get(), TUNSETIFF, &request) != 0) {
        const int error = errno;
        const bool there = if_nametoindex(setup_.name.c_str()) != 0;
        if (error == EBUSY) {
            return "interface " + setup_.name +
                   " is in use by another process; use another name, for example hal%d";
        }
        if (there && error == EINVAL) {
            return "interface " + setup_.name +
                   " exists, but is not a TAP interface; use another name, for example hal%d";
        }
        if (is_denied(error) && there) {
            return "interface " + setup_.name + " belongs to another user; " + by_hand();
        }
        if (is_denied(error)) {
            return "interface " + setup_.name +
                   " needs the capability CAP_NET_ADMIN; grant it with: " +
                   grant_command(privilege::net_admin) + "; or " + by_hand();
        }
        return "cannot create interface " + setup_.name + ": " + link::reason(error);
    }
    name_ = request.ifr_name;
    return {};
}

/// Returns the commands with which an administrator creates the interface for an unprivileged user.
std::string Interface::by_hand() const {
    std::string text = "create it once: sudo ip tuntap add dev " + setup_.name +
                       " mode tap user $USER; sudo ip link set " + setup_.name;
    if (setup_.address) {
        text += " address " + ethernet::to_string(*setup_.address);
    }
    if (setup_.address) {
        text += " mtu " + (setup_.mtu != 0 ? std::to_string(setup_.mtu) : "BYTES");
    }
    text += " up";
    if (setup_.ip) {
        text += "; sudo ip addr add " + prefixed(setup_) + " dev " + setup_.name;
    }
    return text;
}

std::string Interface::cannot_set(const std::string& what) const {
    const int error = errno;
    return "cannot set " + what + " of interface " + name_ + ": " + link::reason(error) +
           (is_denied(error) ? "; " + by_hand() : "");
}

std::string Interface::apply_address() {
    if (!setup_.address) {
        return {};
    }
    ifreq now{};
    if (!ask(socket_, name_, SIOCGIFHWADDR, now)) {
        return "cannot query interface " + name_ + ": " + link::reason();
    }
    if (std::equal(setup_.address->begin(), setup_.address->end(),
                   reinterpret_cast<const std::uint8_t*>(now.ifr_hwaddr.sa_data))) {
        return {};
    }
    now.ifr_hwaddr.sa_family = ARPHRD_ETHER;
    std::copy(setup_.address->begin(), setup_.address->end(),
              reinterpret_cast<std::uint8_t*>(now.ifr_hwaddr.sa_data));
    return ask(socket_, name_, SIOCSIFHWADDR, now)
               ? ""
               : cannot_set("address " + ethernet::to_string(*setup_.address));
}

std::string Interface::apply_mtu() {
    ifreq now{};
    if (setup_.mtu == 0 ||
        (ask(socket_, name_, SIOCGIFMTU, now) && now.ifr_mtu == static_cast<int>(setup_.mtu))) {
        return {};
    }
    now.ifr_mtu = static_cast<int>(setup_.mtu);
    return ask(socket_, name_, SIOCSIFMTU, now) ? ""
                                                : cannot_set("MTU " + std::to_string(setup_.mtu));
}

std::string Interface::apply_ip() {
    if (!setup_.ip) {
        return {};
    }
    const std::uint32_t mask =
        htonl(setup_.prefix == 0 ? 0 : ~std::uint32_t{0} << (32 - setup_.prefix));
    const auto wanted = std::bit_cast<std::uint32_t>(*setup_.ip);
    ifreq ip{};
    ifreq net{};
    const bool same = ask(socket_, name_, SIOCGIFADDR, ip) && ip_of(ip).s_addr == wanted &&
                      ask(socket_, name_, SIOCGIFNETMASK, net) && ip_of(net).s_addr == mask;
    ip = {};
    net = {};
    ip_of(ip).s_addr = wanted;
    ip_of(net).s_addr = mask;
    const bool set =
        same || (ask(socket_, name_, SIOCSIFADDR, ip) && ask(socket_, name_, SIOCSIFNETMASK, net));
    return set ? "" : cannot_set("IP " + prefixed(setup_));
}

std::string Interface::bring_up() {
    ifreq flags{};
    if (!ask(socket_, name_, SIOCGIFFLAGS, flags)) {
        return "cannot query interface " + name_ + ": " + link::reason();
    }
    if ((flags.ifr_flags & IFF_UP) != 0) {
        return {};
    }
    flags.ifr_flags = static_cast<short>(flags.ifr_flags | IFF_UP);
    return ask(socket_, name_, SIOCSIFFLAGS, flags) ? "" : cannot_set("state up");
}

std::string Interface::set_ip(const Ip& ip) {
    setup_.ip = ip;
    return apply_ip();
}

std::string Interface::set_mtu(std::size_t bytes) {
    setup_.mtu = bytes;
    return apply_mtu();
}

void Interface::show_carrier(bool up) noexcept {
    int carrier = up ? 1 : 0;
    (void)ioctl(device_.get(), TUNSETCARRIER, &carrier);
}

std::string wrong_name(std::string_view name) {
    const std::size_t percent = name.find('%');
    const bool number = percent != name.npos && name.substr(percent, 2) == "%d" &&
                        name.find('%', percent + 2) == name.npos;
    const bool letters = std::all_of(name.begin(), name.end(), [](char c) {
        return c > ' ' && c < 127 && c != '/' && c != ':';
    });
    if (!name.empty() && name.size() < IFNAMSIZ && letters && (percent == name.npos || number) &&
        name != "." && name != "..") {
        return {};
    }
    return "'" + std::string(name) +
           "' is not a valid interface name; use at most 15 letters and digits, for example hal0, "
           "or hal%d for the first free number";
}

std::string to_string(const Ip& ip) {
    std::string text;
    for (const unsigned byte : ip) {
        text += (text.empty() ? "" : ".") + std::to_string(byte);
    }
    return text;
}

}  // namespace hal::tap
