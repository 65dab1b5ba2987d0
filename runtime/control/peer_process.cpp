// SPDX-License-Identifier: MIT
#include "control/peer_process.hpp"

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <string>

#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace hal {

std::int64_t boot_ns() {
    timespec now{};
    clock_gettime(CLOCK_BOOTTIME, &now);
    return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

std::int64_t process_start_ns(pid_t pid) {
    std::FILE* const file = std::fopen(("/proc/" + std::to_string(pid) + "/stat").c_str(), "re");
    if (file == nullptr) return -1;
    char text[1024];
    const std::size_t length = std::fread(text, 1, sizeof text - 1, file);
    std::fclose(file);
    text[length] = '\0';
    // the name, which is in parentheses, may contain blanks; field 22 is the time, and the name 2
    const char* at = std::strrchr(text, ')');
    for (int field = 2; field < 22 && at != nullptr; ++field) {
        at = std::strchr(at + 1, ' ');
    }
    if (at == nullptr) return -1;
    const std::int64_t ticks = std::strtoll(at, nullptr, 10);
    return ticks * (1'000'000'000 / sysconf(_SC_CLK_TCK));
}

int pidfd_of_peer(int fd, pid_t pid, std::int64_t accepted_ns) {
#ifdef SO_PEERPIDFD
    constexpr int peer_pidfd = SO_PEERPIDFD;
#else
    constexpr int peer_pidfd = 77;  // Linux 6.5
#endif
    int process = -1;
    socklen_t size = sizeof process;
    if (getsockopt(fd, SOL_SOCKET, peer_pidfd, &process, &size) == 0) return process;
    return pidfd_by_pid(pid, accepted_ns);
}

int pidfd_by_pid(pid_t pid, std::int64_t accepted_ns) {
    const int process = static_cast<int>(syscall(SYS_pidfd_open, pid, 0));
    if (process < 0) return -1;
    // A process that started after the connection was accepted did not make it.
    const std::int64_t start = process_start_ns(pid);
    if (start >= 0 && start <= accepted_ns) return process;
    close(process);
    errno = start < 0 ? EPERM : ESRCH;
    return -1;
}

}  // namespace hal
