// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include <sys/wait.h>
#include <unistd.h>

#include "machine/report/cpu_occupant.hpp"
#include "text/folder_entries.hpp"

namespace hal::test {
namespace {

TEST(CpuOccupant, processes_that_end_while_they_are_read_are_left_out) {
    std::atomic<bool> over{false};
    std::thread others([&over] {
        while (!over) {
            const pid_t child = fork();
            if (child == 0) {
                _exit(0);
            }
            if (child > 0) {
                waitpid(child, nullptr, 0);
            }
        }
    });
    for (int i = 0; i < 100; ++i) {
        EXPECT_NO_THROW(cpu_occupant(0));
    }
    over = true;
    others.join();
}

TEST(FolderEntries, a_folder_that_cannot_be_read_is_empty) {
    EXPECT_TRUE(folder_entries("/proc/nobody/task").empty());
    EXPECT_TRUE(folder_entries("/proc/self/stat").empty());
    EXPECT_FALSE(folder_entries("/proc/self/task").empty());
}

}  // namespace
}  // namespace hal::test
