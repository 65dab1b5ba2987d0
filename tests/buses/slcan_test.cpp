// SPDX-License-Identifier: MIT
// A serial line that disconnects and reconnects: a pseudo-terminal behind a name that stays.
#include <gtest/gtest.h>

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string>
#include <thread>

#include "link/can.hpp"

namespace hal::can {
namespace {

constexpr std::int64_t second = 1'000'000'000;

/// The adapter's end. The device's name is a link to whichever terminal is plugged in.
struct Adapter {
    Adapter() {
        char name[] = "/tmp/halcyon-slcan-XXXXXX";
        folder = ::mkdtemp(name);
        device = folder / "ttyACM0";
    }
    ~Adapter() {
        unplug();
        std::filesystem::remove_all(folder);
    }
    void plug() {
        end = ::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK);
        if (end < 0) return;
        ASSERT_EQ(::grantpt(end), 0);
        ASSERT_EQ(::unlockpt(end), 0);
        std::filesystem::create_symlink(::ptsname(end), folder / "next");
        std::filesystem::rename(folder / "next", device);
    }
    void unplug() {
        if (end >= 0) {
            ::close(end);
        }
        end = -1;
    }
    /// What came until now, or, when `until` is given, until that came.
    std::string heard(const std::string& until = {}) {
        std::string text;
        while (until.empty() || text.find(until) == std::string::npos) {
            char some[256];
            const auto got = ::read(end, some, sizeof some);
            if (got > 0) {
                text.append(some, static_cast<std::size_t>(got));
                continue;
            }
            pollfd p{end, POLLIN, 0};
            if (until.empty() || ::poll(&p, 1, 20'000) <= 0) break;
        }
        return text;
    }
    void say(const std::string& text) const {
        EXPECT_EQ(::write(end, text.data(), text.size()), static_cast<ssize_t>(text.size()));
    }

    std::filesystem::path folder, device;
    int end = -1;
};

TEST(Slcan, a_line_that_is_pulled_out_and_plugged_in_again_goes_on_without_old_frames) {
    Adapter adapter;
    adapter.plug();
    // qemu-user in a user namespace
    if (adapter.end < 0) {
        GTEST_SKIP() << "the system gives no pseudo-terminal: " << std::strerror(errno);
    }
    auto opened = open("slcan:" + adapter.device.string() + "?bitrate=500k");
    ASSERT_TRUE(opened) << opened.problem;
    auto& link = *opened.link;
    EXPECT_NE(adapter.heard("O\r").find("S6\r"), std::string::npos);
    adapter.say("t12321122\r");
    Frame f;
    ASSERT_TRUE(link.wait(20 * second));
    ASSERT_TRUE(link.receive(f, unclocked));
    EXPECT_TRUE(f.same({0x123, {0x11, 0x22}}));

    // More than the line takes: some of it is written, some waits behind half a line.
    while (link.send({0x7ff, {1, 2, 3, 4, 5, 6, 7, 8}}, unclocked) == Sent::queued) {
    }
    EXPECT_GT(link.statistics().queued, 0U);
    adapter.say("t4562");  // and half a line comes
    while (link.receive(f, unclocked)) {
    }
    adapter.unplug();
    ASSERT_TRUE(link.wait(20 * second));
    EXPECT_FALSE(link.receive(f, unclocked));
    EXPECT_EQ(link.state(), State::down);
    EXPECT_EQ(link.send({0x10, {1}}, unclocked), Sent::down);
    link.flush(unclocked);
    EXPECT_EQ(link.statistics().queued, 0U);

    adapter.plug();
    ASSERT_GE(adapter.end, 0);
    ASSERT_TRUE(link.wait(20 * second));
    EXPECT_EQ(link.state(), State::active);
    EXPECT_EQ(link.statistics().restarts, 1U);
    const auto opening = adapter.heard("O\r");
    EXPECT_NE(opening.find("S6\r"), std::string::npos);  // the adapter is set up anew
    EXPECT_EQ(opening.find('t'), std::string::npos) << opening;
    EXPECT_EQ(link.send({0x20, {0xab}}, unclocked), Sent::queued);
    link.flush(unclocked);
    EXPECT_EQ(adapter.heard("t0201AB\r"), "t0201AB\r");
    adapter.say("\rt3211FF\r");
    ASSERT_TRUE(link.wait(20 * second));
    ASSERT_TRUE(link.receive(f, unclocked));
    EXPECT_TRUE(f.same({0x321, {0xff}}));
}

// At 10 kbit/s what is queued needs seconds: the safe values at its end must arrive all the same,
// and a reader that is gone must not block.
TEST(Slcan, a_slow_line_gets_all_that_is_queued_before_it_is_closed) {
    Adapter adapter;
    adapter.plug();
    if (adapter.end < 0) {
        GTEST_SKIP() << "the system gives no pseudo-terminal: " << std::strerror(errno);
    }
    auto opened = open("slcan:" + adapter.device.string() + "?bitrate=10k");
    ASSERT_TRUE(opened) << opened.problem;
    adapter.heard("O\r");
    EXPECT_EQ(opened.link->closing_ns(), 0);
    std::size_t sent = 0;
    const Frame frame(0x123, {1, 2, 3, 4, 5, 6, 7, 8});
    while (opened.link->send(frame, unclocked) == Sent::queued) {
        ++sent;
    }
    EXPECT_GT(opened.link->closing_ns(), 2 * second);
    EXPECT_LE(opened.link->closing_ns(), 60 * second);
    std::string text;
    std::thread reader([&] { text = adapter.heard("C\r"); });
    opened.link.reset();
    reader.join();
    const auto frames = static_cast<std::size_t>(std::count(text.begin(), text.end(), 't'));
    EXPECT_EQ(frames, sent);
}

TEST(Slcan, a_line_that_is_not_there_is_refused_with_what_to_look_at) {
    const auto opened = open("slcan:/dev/no-such-line");
    ASSERT_FALSE(opened);
    EXPECT_EQ(opened.problem,
              "slcan:/dev/no-such-line: no such device; to list adapters: ls /dev/serial/by-id");
}

}  // namespace
}  // namespace hal::can
