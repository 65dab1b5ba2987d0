// SPDX-License-Identifier: MIT
#include <csignal>
#include <future>
#include <gtest/gtest.h>
#include <unistd.h>

#include "tools/cli/signals.hpp"

namespace hal::tools {
namespace {

struct StopRequestTest : testing::Test {
    sigset_t before{};
    StopRequestTest() { ::pthread_sigmask(SIG_BLOCK, nullptr, &before); }
    ~StopRequestTest() override { ::pthread_sigmask(SIG_SETMASK, &before, nullptr); }
};

TEST_F(StopRequestTest, waits_until_requested_or_for_the_time) {
    StopRequest stop;
    EXPECT_FALSE(stop.wait_ns(0));
    EXPECT_FALSE(stop.wait_ns(1'000'000));
    auto waiting = std::async(std::launch::async, [&] { return stop.wait_ns(-1); });
    stop.request();
    EXPECT_TRUE(waiting.get());
    EXPECT_TRUE(stop.wait_ns(-1));
}

TEST_F(StopRequestTest, every_ending_signal_requests_it) {
    for (const int number : {SIGINT, SIGTERM, SIGHUP}) {
        StopRequest stop;
        ::kill(::getpid(), number);
        EXPECT_TRUE(stop.wait_ns(-1)) << number;
    }
}

TEST_F(StopRequestTest, spared_an_interrupt_is_only_told) {
    StopRequest stop;
    int told = 0;  // called under the lock that spare() takes
    stop.when_signalled([&] { ++told; });
    stop.spare(true);
    ::kill(::getpid(), SIGINT);
    stop.spare(false);  // takes the pending one with the old meaning, if the thread has not yet
    EXPECT_EQ(told, 1);
    EXPECT_FALSE(stop.requested());
    stop.spare(true);
    ::kill(::getpid(), SIGTERM);
    stop.spare(false);
    EXPECT_TRUE(stop.requested()) << "SIGTERM is never spared";
}

TEST_F(StopRequestTest, after_release_nobody_is_told) {
    StopRequest stop;
    bool told = false;
    stop.when_signalled([&] { told = true; });
    stop.release();
    ::kill(::getpid(), SIGTERM);
    EXPECT_FALSE(stop.wait_ns(1'000'000));
    EXPECT_FALSE(told);
    // it is still pending, and must not reach the next test
    sigset_t term;
    sigemptyset(&term);
    sigaddset(&term, SIGTERM);
    const timespec none{};
    EXPECT_EQ(::sigtimedwait(&term, nullptr, &none), SIGTERM);
}

}  // namespace
}  // namespace hal::tools
