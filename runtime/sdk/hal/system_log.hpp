// SPDX-License-Identifier: MIT
// The last way out for a message that its usual destination rejects, a full disk for example: the
// system's log. [setup]
#pragma once

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <string>
#include <string_view>

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

namespace hal {

/// Sends a message to the system's log (syslog, or systemd's journal) as severity critical of the
/// facility daemon (RFC 3164, 4.1.1). `name`: the program's. Never blocks. Returns false when the
/// log is missing or does not accept the message.
inline bool write_system_log(std::string_view name, std::string_view message,
                             const char* socket_path = "/dev/log") noexcept {
    constexpr std::size_t max_bytes = 1024;  // RFC 3164, 4.1
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    if (std::strlen(socket_path) >= sizeof address.sun_path) return false;
    std::strcpy(address.sun_path, socket_path);
    std::string packet;
    try {
        packet = "<26>";
        packet += name;
        packet += "[" + std::to_string(::getpid()) + "]: ";
        packet += message;
        while (packet.ends_with('\n')) {
            packet.pop_back();
        }
        packet.resize(std::min(packet.size(), max_bytes));
    } catch (...) {
        return false;
    }
    const int log = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (log < 0) return false;
    const ssize_t sent = ::sendto(log, packet.data(), packet.size(), MSG_NOSIGNAL,
                                  reinterpret_cast<const sockaddr*>(&address), sizeof address);
    ::close(log);
    return sent == static_cast<ssize_t>(packet.size());
}

/// Writes all of a text. Returns false, with errno, when a part of it is missing.
inline bool write_whole(int file, std::string_view text) noexcept {
    while (!text.empty()) {
        const ssize_t written = ::write(file, text.data(), text.size());
        if (written < 0 && errno == EINTR) continue;
        if (written <= 0) return false;
        text.remove_prefix(static_cast<std::size_t>(written));
    }
    return true;
}

}  // namespace hal
