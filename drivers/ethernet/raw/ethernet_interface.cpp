// SPDX-License-Identifier: MIT
#include "ethernet_interface.hpp"

#include <linux/ethtool.h>
#include <linux/sockios.h>
#include <net/if.h>
#include <net/if_arp.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <cstring>

#include "link/system.hpp"
#include "text/quoting.hpp"

namespace hal::ethernet::rawether {

Interface ask(const std::string& name) {
    Interface found;
    const link::Descriptor socket(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
    if (!socket || name.empty() || name.size() >= IFNAMSIZ) return found;
    ifreq request{};
    name.copy(request.ifr_name, IFNAMSIZ - 1);
    const auto answered = [&](unsigned long what) {
        return ioctl(socket.get(), what, &request) == 0;
    };
    if (!answered(SIOCGIFINDEX)) return found;
    found.index = request.ifr_ifindex;
    if (answered(SIOCGIFFLAGS)) {
        found.up = (request.ifr_flags & IFF_UP) != 0 && (request.ifr_flags & IFF_RUNNING) != 0;
    }
    if (answered(SIOCGIFMTU)) {
        found.mtu = static_cast<std::uint32_t>(request.ifr_mtu);
    }
    if (answered(SIOCGIFHWADDR)) {
        found.ethernet = request.ifr_hwaddr.sa_family == ARPHRD_ETHER ||
                         request.ifr_hwaddr.sa_family == ARPHRD_LOOPBACK;
        std::memcpy(found.address.data(), request.ifr_hwaddr.sa_data, found.address.size());
    }
    // The first request returns the number of link mode words, the second the settings.
    alignas(ethtool_link_settings)
        std::array<char,
                   sizeof(ethtool_link_settings) + std::size_t{3} * 127 * sizeof(std::uint32_t)>
            buffer{};
    auto& link = reinterpret_cast<ethtool_link_settings&>(buffer);
    link.cmd = ETHTOOL_GLINKSETTINGS;
    request.ifr_data = buffer.data();
    if (answered(SIOCETHTOOL) && link.link_mode_masks_nwords < 0) {
        link.cmd = ETHTOOL_GLINKSETTINGS;
        link.link_mode_masks_nwords = static_cast<std::int8_t>(-link.link_mode_masks_nwords);
        if (answered(SIOCETHTOOL) && link.speed != static_cast<std::uint32_t>(SPEED_UNKNOWN)) {
            found.speed = link.speed;
        }
    }
    return found;
}

std::string interfaces() {
    std::string names;
    if (auto* const all = if_nameindex()) {
        for (const auto* i = all; i->if_index != 0; ++i) {
            append_item(names, i->if_name);
        }
        if_freenameindex(all);
    }
    return names;
}

}  // namespace hal::ethernet::rawether
