// SPDX-License-Identifier: MIT
// Where the control socket of an instance is: $XDG_RUNTIME_DIR/halcyon/NAME.sock, else
// /tmp/halcyon-UID/NAME.sock.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace hal {

/// True for names an instance may have: 1 to 64 letters, digits, `-`, `_`, `.`, not beginning with
/// a dot.
bool good_instance_name(std::string_view name);

/// The folder of the control sockets, without a final slash. It need not exist.
std::string socket_folder();
std::string socket_path(std::string_view name);
/// The file beside the socket that a running instance keeps locked; it contains the process id.
std::string lock_path(std::string_view name);

/// Returns whether the instance of this name left its socket behind: one that ends in order removes
/// it, and one that runs holds its lock. Waits up to 1 s for a process that is just ending.
bool was_killed(std::string_view name);

/// Names of the instances that run now and belong to this user, sorted. Removes what killed
/// instances left behind.
std::vector<std::string> running_instances();

/// The instance that a tool uses when its user asked for `wanted` (may be empty): that one; else
/// $HALCYON_INSTANCE; else the only one that runs; else "default".
std::string instance_wanted(std::string_view wanted);

}  // namespace hal
