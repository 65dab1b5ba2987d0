// SPDX-License-Identifier: MIT
// The listening socket of an instance and the lock file that shows it is running. Internal to the
// server.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include <sys/types.h>

#include "text/diagnostic.hpp"

namespace hal {

class Endpoint {
public:
    Endpoint() = default;
    ~Endpoint() { close_all(); }  ///< removes the socket and the lock file
    Endpoint(const Endpoint&) = delete;

    /// `group`: may use the socket, too; empty: none. False after reporting: the name or the group
    /// is bad, the folder is not ours alone, an instance of this name runs.
    bool open(std::string_view name, const std::string& group, Diagnostics& diagnostics);
    /// Removes the socket. Clients whose connection closes afterwards find it gone: this end is in
    /// order.
    void stop_listening();
    void close_all();
    int fd() const { return socket_; }
    std::optional<gid_t> group() const { return group_; }
    const std::string& path() const { return path_; }

private:
    bool prepare_folder(const std::string& folder, Diagnostics& diagnostics);
    bool take_lock(std::string_view name, Diagnostics& diagnostics);
    bool give_to_group(int file, mode_t mode) const;
    bool share_socket() const;
    bool listen_at(Diagnostics& diagnostics);

    std::string path_, lock_file_;
    std::optional<gid_t> group_;
    int lock_ = -1;
    int socket_ = -1;
};

}  // namespace hal
