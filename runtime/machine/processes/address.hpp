// SPDX-License-Identifier: MIT
// Where the control socket of an instance is: $XDG_RUNTIME_DIR/halcyon/NAME.sock, else
// /tmp/halcyon-UID/NAME.sock; of the service halcyon@NAME: /run/halcyon/NAME/halcyon/NAME.sock.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace hal {

/// True for names an instance may have: 1 to 64 letters, digits, `-`, `_`, `.`, not beginning with
/// a dot.
bool good_instance_name(std::string_view name);

/// The folder of this user's control sockets, without a final slash. It need not exist.
std::string socket_folder();
std::string socket_path(std::string_view name);
/// The socket that a client connects to: this user's, else that of a service which shares it with a
/// group of this user; socket_path() when there is neither.
std::string found_socket(std::string_view name);
/// The group that a service of this name shares its socket with; empty: it shares none, or this
/// user is in it.
std::string group_without_user(std::string_view name);
/// The file beside the socket that a running instance keeps locked; it contains the process id.
std::string lock_path(std::string_view name);

enum class InstanceEnd {
    ended,  ///< in order
    killed,  ///< without removing its socket
    running  ///< it has not ended
};

/// The lock file of an instance, opened while it runs: also when the file is removed or another
/// instance of this name is started meanwhile, it shows how this one ended.
class InstanceWitness {
public:
    InstanceWitness() = default;
    ~InstanceWitness();
    InstanceWitness(const InstanceWitness&) = delete;

    void watch(std::string_view name, std::int64_t pid);
    /// Waits up to 1 s for a process that is just ending.
    InstanceEnd end() const;

private:
    int file_ = -1;
    std::string content_;
};
/// What the lock file of the running process `pid` contains. One that ends in order empties it
/// before it closes its connections.
std::string lock_content(std::int64_t pid);

/// Names of the instances that run now and belong to this user or are shared with it, sorted.
/// Removes what killed instances of this user left behind.
std::vector<std::string> running_instances();

/// The instance that a tool uses when its user asked for `wanted` (may be empty): that one; else
/// $HALCYON_INSTANCE; else the only one that runs; else "default".
std::string instance_wanted(std::string_view wanted);

}  // namespace hal
