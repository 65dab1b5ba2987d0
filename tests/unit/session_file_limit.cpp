// SPDX-License-Identifier: MIT
// A lowered limit of open files, in a child process that lowers its own.
#include <string>

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "machine/report/file_limit.hpp"

namespace hal::test {
namespace {

constexpr std::int64_t second = 1'000'000'000;

/// Runs `act` in a child process that begins with a limit of 512 files of at most `hard`, and
/// returns the lines that it returns, joined.
template <class Act>
std::string in_child(rlim_t hard, Act act) {
    int ends[2];
    EXPECT_EQ(pipe(ends), 0);
    const pid_t child = fork();
    if (child == 0) {
        const rlimit begun{512, hard};
        setrlimit(RLIMIT_NOFILE, &begun);
        FileLimit limit;
        const std::string text = act(limit);
        (void)!write(ends[1], text.data(), text.size());
        _exit(0);
    }
    close(ends[1]);
    std::string text;
    char part[512];
    for (ssize_t got = 0; (got = read(ends[0], part, sizeof part)) > 0;) {
        text.append(part, static_cast<std::size_t>(got));
    }
    close(ends[0]);
    waitpid(child, nullptr, 0);
    return text;
}

void lower(rlim_t soft, rlim_t hard) {
    const rlimit lowered{soft, hard};
    setrlimit(RLIMIT_NOFILE, &lowered);
}

rlim_t soft_limit() {
    rlimit now{};
    getrlimit(RLIMIT_NOFILE, &now);
    return now.rlim_cur;
}

TEST(FileLimit, is_raised_again_and_reported_once_per_minute_with_the_number_of_times) {
    const std::string lines = in_child(1024, [](FileLimit& limit) {
        std::string text = limit.restore(0).value_or("nothing\n");
        for (const std::int64_t at : {1, 2, 3, 62}) {
            lower(64, 1024);
            text += limit.restore(at * second).value_or("");
            text += soft_limit() == 512 ? "" : "not raised\n";
        }
        lower(32, 1024);
        text += limit.restore(63 * second).value_or("not yet\n");
        // it is lowered no more, and the last time is reported all the same
        text += limit.restore(122 * second).value_or("nothing\n");
        text += limit.restore(200 * second).value_or("nothing\n");
        return text;
    });
    EXPECT_EQ(lines,
              "nothing\n"
              "hal: the limit of open files was lowered from 512 to 64 by a component or another "
              "process; it was raised again\n"
              "hal: the limit of open files was lowered from 512 to 64 by a component or another "
              "process, 3 times; it was raised again\n"
              "not yet\n"
              "hal: the limit of open files was lowered from 512 to 32 by a component or another "
              "process; it was raised again\n"
              "nothing\n");
}

TEST(FileLimit, that_the_hard_limit_holds_down_is_raised_to_it_and_reported_once) {
    const std::string lines = in_child(1024, [](FileLimit& limit) {
        // without the capability to raise a hard limit, root too
        if (geteuid() == 0 &&
            (setresgid(65534, 65534, 65534) != 0 || setresuid(65534, 65534, 65534) != 0)) {
            return std::string("cannot drop privileges\n");
        }
        lower(64, 100);
        std::string text = limit.restore(second).value_or("");
        text += std::to_string(soft_limit()) + "\n";
        text += limit.restore(2 * second).value_or("");
        const std::string number = "--pid " + std::to_string(getpid());
        if (const auto at = text.find(number); at != text.npos) {
            text.replace(at, number.size(), "--pid N");
        }
        return text;
    });
    EXPECT_EQ(lines,
              "hal: the limit of open files was lowered from 512 to 64 by a component or another "
              "process, and cannot be raised beyond 100: a client for which no file is left cannot "
              "connect; SIGTERM ends the machine; to raise it, type as root: prlimit --nofile=512 "
              "--pid N\n"
              "100\n");
}

}  // namespace
}  // namespace hal::test
