// SPDX-License-Identifier: MIT
// The raw Ethernet driver on pairs of interfaces that each test makes, in a network namespace of
// this program's own: nothing of the machine's network is touched.
#include <gtest/gtest.h>

#include <fcntl.h>
#include <sched.h>
#include <unistd.h>

#include <cstdio>
#include <string>

#include "interfaces.hpp"

namespace hal::ethernet {

namespace {

bool write_file(const char* path, const std::string& text) {
    const int fd = ::open(path, O_WRONLY | O_CLOEXEC);
    const bool done =
        fd >= 0 && ::write(fd, text.data(), text.size()) == static_cast<ssize_t>(text.size());
    if (fd >= 0) {
        ::close(fd);
    }
    return done;
}

/// Why there is no namespace, or nothing.
std::string enter() {
    const auto user = getuid();
    const auto group = getgid();
    if (::unshare(CLONE_NEWNET) != 0) {
        if (::unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0) {
            return "no network namespace may be made here (run as root, or allow user namespaces)";
        }
        if (!write_file("/proc/self/setgroups", "deny") ||
            !write_file("/proc/self/uid_map", "0 " + std::to_string(user) + " 1") ||
            !write_file("/proc/self/gid_map", "0 " + std::to_string(group) + " 1")) {
            return "the user namespace cannot be set up";
        }
    }
    if (!command("ip link set lo up")) return "`ip` of iproute2 is missing or not permitted";
    if (!command("ip link add probe0 type veth peer name probe1")) return "the kernel has no veth";
    command("ip link del probe0");
    return {};
}

}  // namespace

std::string no_namespace;

bool command(const std::string& line) { return std::system((line + " 2>/dev/null").c_str()) == 0; }

}  // namespace hal::ethernet

int main(int argc, char** argv) {
    testing::InitGoogleTest(&argc, argv);
    if (!GTEST_FLAG_GET(list_tests)) {
        hal::ethernet::no_namespace = hal::ethernet::enter();
    }
    return RUN_ALL_TESTS();
}
