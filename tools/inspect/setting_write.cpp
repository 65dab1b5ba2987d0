// SPDX-License-Identifier: MIT
#include "inspect/setting_write.hpp"

#include <cerrno>
#include <fcntl.h>
#include <linux/sockios.h>
#include <net/if.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

namespace hal::tools {

int ask_driver(const std::string& interface, void* request) {
    const int socket = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (socket < 0) return errno;
    ifreq wrapped{};
    interface.copy(wrapped.ifr_name, IFNAMSIZ - 1);
    wrapped.ifr_data = static_cast<char*>(request);
    const int problem = ::ioctl(socket, SIOCETHTOOL, &wrapped) == 0 ? 0 : errno;
    ::close(socket);
    return problem;
}

int SettingWrite::run(const std::string& interface) const {
    if (file.empty()) {
        auto copy = request;  // the driver may write its answer into it
        return ask_driver(interface, copy.data());
    }
    const int descriptor = ::open(file.c_str(), O_WRONLY | O_CLOEXEC);
    if (descriptor < 0) return errno;
    const bool written =
        ::write(descriptor, text.data(), text.size()) == static_cast<ssize_t>(text.size());
    const int problem = written ? 0 : errno;
    ::close(descriptor);
    return problem;
}

}  // namespace hal::tools
