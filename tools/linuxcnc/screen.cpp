// SPDX-License-Identifier: MIT
#include "linuxcnc/screen.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

namespace hal::tools {

namespace {

std::string variable(const char* name) {
    const char* const text = std::getenv(name);
    return text ? text : "";
}

/// The number of an X display of this computer, which has no host before its colon: ":0.0" has 0.
/// Empty for others.
std::string local_display(const std::string& name) {
    if (!name.starts_with(':')) return {};
    const std::size_t end = name.find('.');
    return name.substr(1, end == name.npos ? end : end - 1);
}

/// Whether a program listens at a Unix socket. `abstract`: its name is not that of a file.
bool listens(const std::string& path, bool abstract) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    const std::size_t first = abstract ? 1 : 0;
    const std::size_t size = std::min(path.size(), sizeof address.sun_path - 1 - first);
    std::memcpy(address.sun_path + first, path.data(), size);
    const int descriptor = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (descriptor < 0) return true;  // unknown: the program finds out
    const auto length =
        static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + first + size + (abstract ? 0 : 1));
    const bool connected =
        ::connect(descriptor, reinterpret_cast<const sockaddr*>(&address), length) == 0;
    ::close(descriptor);
    return connected;
}

}  // namespace

std::string screen_problem() {
    const std::string display = variable("DISPLAY");
    if (display.empty()) {
        return variable("WAYLAND_DISPLAY").empty() ? "the environment has no DISPLAY" : "";
    }
    const std::string number = local_display(display);
    if (number.empty()) return {};
    const std::string path = "/tmp/.X11-unix/X" + number;
    if (listens(path, false) || listens(path, true)) return {};
    return fmt::format("no screen answers at the environment's DISPLAY '{}'", display);
}

}  // namespace hal::tools
