// SPDX-License-Identifier: MIT
// A component that kills the process: outputs first, then a report, then death by the signal it
// was.
#include <csignal>
#include <cstdio>
#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <regex>
#include <string>

#include <gtest/gtest.h>

#include "machine/report/setup_guard.hpp"

namespace hal::test {
namespace {

struct Death {
    const char* dies;
    int signal;
    const char* words;
};

struct Result {
    int status = 0;
    std::string said;
};

Result run(const char* clock, const std::string& netlist) {
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) {
        return {};
    }
    const std::string plugins = HALCYON_TEST_PLUGINS;
    const std::string program = plugins + "/../netlist_process";
    const pid_t child = fork();
    if (child == 0) {
        dup2(ends[1], STDERR_FILENO);
        execl(program.c_str(), program.c_str(), plugins.c_str(), clock, netlist.c_str(), nullptr);
        _exit(127);
    }
    close(ends[1]);
    Result result;
    char part[512];
    for (ssize_t got; (got = read(ends[0], part, sizeof part)) > 0;) {
        result.said.append(part, static_cast<std::size_t>(got));
    }
    close(ends[0]);
    waitpid(child, &result.status, 0);
    return result;
}

std::string netlist(const char* dies) {
    return std::string(
               "loadrt threads name1=t period1=1000000\nloadrt test-faulty names=f\nloadrt "
               "test-counter names=c\naddf c t\naddf f.run t\nsetp f.dies ") +
           dies + "\n";
}

struct Crash : testing::TestWithParam<std::tuple<const char*, Death>> {};

TEST_P(Crash, makes_outputs_safe_names_the_function_and_dies_by_its_signal) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    GTEST_SKIP() << "the sanitizer reports crashes itself";
#endif
    const auto& [clock, death] = GetParam();
    const Result result = run(clock, netlist(death.dies));
    ASSERT_TRUE(WIFSIGNALED(result.status)) << result.status << " " << result.said;
    EXPECT_EQ(WTERMSIG(result.status), death.signal) << result.said;
    std::string report =
        std::regex_replace(result.said, std::regex("at cycle [0-9]+;"), "at cycle N;");
#if defined(HALCYON_EMULATED)
    report = std::regex_replace(report, std::regex("qemu: uncaught target signal [^\n]*\n"),
                                "");  // the emulator's own last word
#endif
    EXPECT_EQ(
        report,
        std::string("emergency function called\nhal: test-faulty: function 'f.run' crashed (") +
            death.words +
            ") at cycle N; outputs were set to their safe values; the process ends\n");
}

#if defined(__aarch64__)
constexpr Death trap{"4", SIGTRAP, "trap"};  // what __builtin_trap() is there
#else
constexpr Death trap{"4", SIGILL, "illegal instruction"};
#endif

INSTANTIATE_TEST_SUITE_P(
    In, Crash,
    testing::Combine(testing::Values("real", "virtual"),
                     testing::Values(Death{"1", SIGSEGV, "segmentation fault"},
                                     Death{"2", SIGABRT, "abort"},
                                     Death{"3", SIGSEGV, "segmentation fault"}, trap,
                                     Death{"5", SIGFPE, "integer division by zero or overflow"})),
    [](const auto& death) {
        return std::string(std::get<0>(death.param)) + std::get<1>(death.param).dies;
    });

struct Exit {
    const char *dies, *call;
};
struct Exits : testing::TestWithParam<std::tuple<const char*, Exit>> {};

TEST_P(Exits, makes_outputs_safe_names_the_function_and_ends_with_a_failure) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    GTEST_SKIP() << "the sanitizer has these functions itself";
#endif
    const auto& [clock, exit] = GetParam();
    const Result result = run(clock, netlist(exit.dies));
    EXPECT_TRUE(WIFEXITED(result.status) && WEXITSTATUS(result.status) == 1) << result.status;
    EXPECT_EQ(std::regex_replace(result.said, std::regex("at cycle [0-9]+;"), "at cycle N;"),
              std::string("emergency function called\nhal: test-faulty: function 'f.run' called ") +
                  exit.call +
                  " at cycle N; outputs were set to their safe values; the process ends\n");
}

INSTANTIATE_TEST_SUITE_P(Of, Exits,
                         testing::Combine(testing::Values("real", "virtual"),
                                          testing::Values(Exit{"6", "exit()"}, Exit{"7", "_exit()"},
                                                          Exit{"8", "quick_exit()"},
                                                          Exit{"9", "the system call exit_group"})),
                         [](const auto& exit) {
                             return std::string(std::get<0>(exit.param)) +
                                    std::get<1>(exit.param).dies;
                         });

TEST(A_constructor_that_exits, is_named) {
    const Result result = run("virtual", "loadrt test-exits in=constructor\n");
    EXPECT_TRUE(WIFEXITED(result.status) && WEXITSTATUS(result.status) == 1) << result.status;
    EXPECT_EQ(result.said,
              "hal: 'test-exits.0' (test-exits) called exit() in its constructor; outputs were set "
              "to their safe values; the process ends\n");
}

TEST(A_start_that_exits, is_named) {
    const Result result = run("virtual", "loadrt test-exits in=start\n");
    EXPECT_TRUE(WIFEXITED(result.status) && WEXITSTATUS(result.status) == 1) << result.status;
    EXPECT_EQ(result.said,
              "hal: 'test-exits.0' (test-exits) called exit() in start; outputs were set to their "
              "safe values; the process ends\n");
}

TEST(A_helper_thread_that_exits, is_named) {
#if defined(__SANITIZE_THREAD__)
    GTEST_SKIP() << "outputs are set to their safe values while the cycle goes on, which the "
                    "sanitizer reports";
#endif
    const Result result = run("real", "newthread t 1000000\nloadrt test-exits in=thread\n");
    EXPECT_TRUE(WIFEXITED(result.status) && WEXITSTATUS(result.status) == 1) << result.status;
    EXPECT_EQ(
        result.said,
        "hal: a thread named 'helper' called exit() while the machine runs; outputs were set to "
        "their safe values; the process ends\n");
}

TEST(A_process_without_a_fault, ends_quietly) {
    const Result result = run("virtual", netlist("0"));
    EXPECT_TRUE(WIFEXITED(result.status) && WEXITSTATUS(result.status) == 0) << result.status;
    EXPECT_EQ(result.said, "");
}

TEST(An_end_that_takes_too_long, is_limited) {
#if defined(__SANITIZE_THREAD__)
    GTEST_SKIP() << "the sanitizer starts no thread in a copy of a process with threads";
#endif
    int text[2];
    ASSERT_EQ(pipe(text), 0);
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
        dup2(text[1], STDERR_FILENO);
        close(text[0]);
        close(text[1]);
        SetupGuard guard;
        guard.end_within(100'000'000);
        pause();
        _exit(0);
    }
    close(text[1]);
    std::string printed;
    char part[256];
    for (ssize_t size = 0; (size = read(text[0], part, sizeof part)) > 0;) {
        printed.append(part, static_cast<std::size_t>(size));
    }
    close(text[0]);
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    EXPECT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 1);
    EXPECT_EQ(printed,
              "hal: the machine has not ended for 1 s: a thread does not end, or gets no CPU time; "
              "outputs set to their safe values; the process ends\n");
}

}  // namespace
}  // namespace hal::test
