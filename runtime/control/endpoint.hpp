// SPDX-License-Identifier: MIT
// The listening socket of an instance and the lock file that shows it is running. Internal to the
// server.
#pragma once

#include <string>
#include <string_view>

#include "text/diagnostic.hpp"

namespace hal {

class Endpoint {
public:
    Endpoint() = default;
    ~Endpoint() { close_all(); }  ///< removes the socket and the lock file
    Endpoint(const Endpoint&) = delete;

    /// False after reporting: the name is bad, the folder is not ours alone, an instance of this
    /// name runs.
    bool open(std::string_view name, Diagnostics& diagnostics);
    /// Removes the socket. Clients whose connection closes afterwards find it gone: this end is in
    /// order.
    void stop_listening();
    void close_all();
    int fd() const { return socket_; }
    const std::string& path() const { return path_; }

private:
    bool take_lock(std::string_view name, Diagnostics& diagnostics);
    bool listen_at(Diagnostics& diagnostics);

    std::string path_, lock_file_;
    int lock_ = -1;
    int socket_ = -1;
};

}  // namespace hal
