// SPDX-License-Identifier: MIT
// What a guardian leaves for the next start, also when the disk is full.
#include <fcntl.h>
#include <gtest/gtest.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include "components/bus/guardian/report.hpp"
#include "hal/system_log.hpp"

namespace {

namespace fs = std::filesystem;

class GuardianReport : public testing::Test {
protected:
    GuardianReport() {
        std::string name = (fs::temp_directory_path() / "report-XXXXXX").string();
        folder = ::mkdtemp(name.data());
        file = (folder / "guardian-line").string();
    }
    ~GuardianReport() override { fs::remove_all(folder); }

    /// Keeps a report while a file has at most so many bytes, as on a full disk.
    bool keep_within(rlim_t bytes, const std::string& text) const {
        const auto before = std::signal(SIGXFSZ, SIG_IGN);
        rlimit limit{};
        ::getrlimit(RLIMIT_FSIZE, &limit);
        const rlimit usual = limit;
        limit.rlim_cur = bytes;
        ::setrlimit(RLIMIT_FSIZE, &limit);
        const bool whole = hal::bus::keep_report(file.c_str(), text);
        ::setrlimit(RLIMIT_FSIZE, &usual);
        std::signal(SIGXFSZ, before);
        return whole;
    }

    fs::path folder;
    std::string file;
};

TEST_F(GuardianReport, is_taken_once) {
    EXPECT_TRUE(hal::bus::keep_report(file.c_str(), "the process has ended; 1.0 ms"));
    EXPECT_EQ(hal::bus::take_report(file), "the process has ended; 1.0 ms");
    EXPECT_EQ(hal::bus::take_report(file), "");
}

TEST_F(GuardianReport, states_that_its_end_is_missing) {
    EXPECT_FALSE(keep_within(15, "the process has ended; 1.0 ms"));
    EXPECT_EQ(hal::bus::take_report(file),
              "the process has … the rest is lost: it could not be written whole (disk full?); the "
              "system's log may have it");
}

TEST_F(GuardianReport, states_that_it_is_lost) {
    EXPECT_FALSE(keep_within(0, "the process has ended; 1.0 ms"));
    EXPECT_EQ(hal::bus::take_report(file),
              "the process has ended; the report is lost: it could not be written whole (disk "
              "full?); the system's log may have it");
}

TEST_F(GuardianReport, states_that_it_has_no_file) {
    hal::bus::ReportLock lock;
    ASSERT_EQ(lock.acquire(file, "sim:line"), "");
    fs::create_directory(file);  // as without a free inode: it cannot be created
    EXPECT_FALSE(hal::bus::keep_report(file.c_str(), "the process has ended; 1.0 ms"));
    fs::remove(file);
    EXPECT_EQ(hal::bus::take_report(file),
              "the process has ended; the report is lost: it could not be written whole (disk "
              "full?); the system's log may have it");
    EXPECT_EQ(hal::bus::take_report(file), "");
    EXPECT_TRUE(hal::bus::keep_report(file.c_str(), "the process has ended; 2.0 ms"));
    EXPECT_EQ(hal::bus::take_report(file), "the process has ended; 2.0 ms");
}

TEST_F(GuardianReport, that_cannot_be_kept_is_known) {
    EXPECT_FALSE(hal::bus::keep_report((folder / "none/report").c_str(), "text"));
    EXPECT_TRUE(hal::bus::keep_report("", "text")) << "there is no folder for it";
}

TEST_F(GuardianReport, is_in_its_file_before_it_is_printed) {
    int output[2];
    ASSERT_EQ(::pipe2(output, O_NONBLOCK | O_CLOEXEC), 0);
    while (::write(output[1], "full", 4) > 0) {
    }
    const pid_t guardian = ::fork();
    ASSERT_GE(guardian, 0);
    if (guardian == 0) {
        ::dup2(output[1], STDERR_FILENO);  // nobody reads it
        hal::bus::report_end("guard", file.c_str(), "the process has ended; 1.0 ms");
        ::_exit(0);
    }
    std::string written;
    while (!written.ends_with('\n') && ::waitpid(guardian, nullptr, WNOHANG) == 0) {
        if (!hal::read_regular_file(file, 1000, written)) written.clear();
    }
    EXPECT_EQ(hal::bus::take_report(file), "the process has ended; 1.0 ms")
        << "only once it was printed, or not at all";
    EXPECT_EQ(::waitpid(guardian, nullptr, 0), guardian) << "a reader that hangs keeps it for ever";
    ::close(output[0]);
    ::close(output[1]);
}

TEST_F(GuardianReport, reaches_the_systems_log) {
    const std::string path = (folder / "log").string();
    EXPECT_FALSE(hal::write_system_log("hal", "nobody listens", path.c_str()));
    const int log = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    ASSERT_GE(log, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    ASSERT_LT(path.size(), sizeof address.sun_path);
    path.copy(address.sun_path, path.size());
    ASSERT_EQ(::bind(log, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    EXPECT_TRUE(hal::write_system_log("hal", "a: guardian: stopped\n", path.c_str()));
    char packet[200];
    const ssize_t size = ::recv(log, packet, sizeof packet, MSG_DONTWAIT);
    ::close(log);
    ASSERT_GT(size, 0);
    EXPECT_EQ(std::string(packet, static_cast<std::size_t>(size)),
              "<26>hal[" + std::to_string(::getpid()) + "]: a: guardian: stopped");
}

TEST(Write_whole, is_false_on_a_full_disk) {
    const int full = ::open("/dev/full", O_WRONLY | O_CLOEXEC);
    ASSERT_GE(full, 0);
    EXPECT_FALSE(hal::write_whole(full, "text"));
    ::close(full);
}

}  // namespace
