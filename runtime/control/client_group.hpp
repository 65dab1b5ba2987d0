// SPDX-License-Identifier: MIT
// The group whose members may control an instance beside its own user: `hal run --group`.
#pragma once

#include <optional>
#include <string>

#include <sys/types.h>

namespace hal {

/// Returns the number of a group of this computer; nothing for an unknown name. [setup]
std::optional<gid_t> group_number(const std::string& name);

/// Returns true when the process at the other end of a connected socket was in the group when it
/// connected, by its primary or by a further group. [any]
bool is_peer_in_group(int socket, gid_t group);

}  // namespace hal
