// SPDX-License-Identifier: MIT
#include "control/client_group.hpp"

#include <algorithm>
#include <vector>

#include <grp.h>
#include <sys/socket.h>

namespace hal {

std::optional<gid_t> group_number(const std::string& name) {
    std::vector<char> text(std::size_t{1} << 16);
    group entry{};
    group* found = nullptr;
    if (getgrnam_r(name.c_str(), &entry, text.data(), text.size(), &found) != 0 || !found) {
        return std::nullopt;
    }
    return found->gr_gid;
}

bool is_peer_in_group(int socket, gid_t group) {
    ucred peer{};
    socklen_t size = sizeof peer;
    if (getsockopt(socket, SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0) return false;
    if (peer.gid == group) return true;
    constexpr std::size_t max_groups = 65536;  // of a process, include/uapi/linux/limits.h
    std::vector<gid_t> groups(max_groups);
    size = static_cast<socklen_t>(groups.size() * sizeof(gid_t));
    if (getsockopt(socket, SOL_SOCKET, SO_PEERGROUPS, groups.data(), &size) != 0) return false;
    groups.resize(size / sizeof(gid_t));
    return std::ranges::find(groups, group) != groups.end();
}

}  // namespace hal
