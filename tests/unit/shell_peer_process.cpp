// SPDX-License-Identifier: MIT
// The process of a client, on a kernel that identifies it by its PID only.
#include <cerrno>
#include <csignal>

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include "control/peer_process.hpp"

namespace hal::test {
namespace {

constexpr std::int64_t second = 1'000'000'000;

/// A process that lives until the test ends it.
struct Child {
    Child() {
        if (pid != 0) return;
        pause();
        _exit(0);
    }
    ~Child() { end(); }
    Child(const Child&) = delete;
    void end() {
        if (pid < 0) return;
        kill(pid, SIGKILL);
        waitpid(pid, nullptr, 0);
        pid = -1;
    }

    pid_t pid = fork();
};

TEST(PeerProcess, has_the_time_of_its_start) {
    const std::int64_t before = boot_ns();
    Child child;
    const std::int64_t start = process_start_ns(child.pid);
    EXPECT_GE(start, before - second / 10) << "in clock ticks, rounded down";
    EXPECT_LE(start, boot_ns());
    const pid_t ended = child.pid;
    child.end();
    EXPECT_EQ(process_start_ns(ended), -1);
}

TEST(PeerProcess, is_watched_until_it_ends) {
    Child child;
    const int process = pidfd_by_pid(child.pid, boot_ns());
    ASSERT_GE(process, 0);
    pollfd look{process, POLLIN, 0};
    EXPECT_EQ(poll(&look, 1, 0), 0);
    child.end();
    EXPECT_EQ(poll(&look, 1, 10'000), 1);
    close(process);
}

TEST(PeerProcess, that_started_after_the_connection_was_accepted_is_another_one) {
    const Child child;
    const std::int64_t accepted = process_start_ns(child.pid) - 1;
    EXPECT_EQ(pidfd_by_pid(child.pid, accepted), -1);
    EXPECT_EQ(errno, ESRCH);
}

}  // namespace
}  // namespace hal::test
