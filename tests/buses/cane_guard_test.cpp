// SPDX-License-Identifier: MIT
// CAN in Ethernet frames: who may command, signed frames, and what counts as lost.
#include <gtest/gtest.h>

#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <fstream>

#include "can/cane/command_guard.hpp"
#include "can/cane/seal.hpp"
#include "cane_bench.hpp"

namespace hal::can::cane::test {
namespace {

TEST(CaneSiphash, gives_the_tags_of_its_publication) {
    const Key key{0x0706050403020100, 0x0f0e0d0c0b0a0908};
    Bytes bytes;
    for (std::uint8_t n = 0; n < 15; ++n) {
        bytes.push_back(n);
    }
    EXPECT_EQ(siphash(key, bytes), 0xa129ca6149be45e5) << "appendix A";
    EXPECT_EQ(siphash(key, std::span(bytes).first(0)), 0x726fdb47dd0e0e31);
    EXPECT_EQ(siphash(key, std::span(bytes).first(8)), 0x93f5f5799a932462);
}

TEST(CaneGuard, takes_commands_of_one_station_while_it_is_alive) {
    Guard guard;
    EXPECT_TRUE(guard.may_command(a, 0)) << "the first is the master";
    EXPECT_FALSE(guard.may_command(b, 1'000'000));
    EXPECT_TRUE(guard.may_command(a, 900'000'000));
    EXPECT_FALSE(guard.may_command(b, 1'800'000'000));
    EXPECT_TRUE(guard.may_command(b, 1'900'000'001)) << "the old one is gone";
    EXPECT_FALSE(guard.may_command(a, 2'000'000'000));
    guard.release();
    EXPECT_TRUE(guard.may_command(a, 2'000'000'001)) << "a flying master took over";
    guard.allow(c);
    EXPECT_TRUE(guard.may_command(c, 2'000'000'002));
    guard.fix(b);
    EXPECT_FALSE(guard.may_command(a, 90'000'000'000));
    EXPECT_TRUE(guard.may_command(b, 90'000'000'000));
}

TEST(CaneGuard, knows_what_commands) {
    for (const std::uint32_t id : {0x000, 0x080, 0x100, 0x201, 0x305, 0x47f, 0x501}) {
        EXPECT_TRUE(Guard::commands(message(id, {}))) << id;
    }
    for (const std::uint32_t id :
         {0x001, 0x081, 0x181, 0x281, 0x481, 0x581, 0x601, 0x701, 0x7e5, 0x200}) {
        EXPECT_FALSE(Guard::commands(message(id, {}))) << id;
    }
    EXPECT_FALSE(Guard::commands(Frame::request(0x205, 8)));
}

TEST(CaneLink, commands_of_another_than_the_master_are_rejected_in_every_format) {
    for (const std::string format : {"packed", "single", "single&order=little"}) {
        const std::string net = "cane:sim:forged-" + format.substr(0, 6) +
                                std::to_string(format.size()) + "?format=" + format;
        auto master = opened(net);
        auto node = opened(net);
        auto stranger = opened(net);
        std::int64_t now = 0;
        const auto get = [&](Link& from, const Frame& f) {
            from.send(f, now);
            from.flush(now);
            now += 1'000'000;
            all_of(*master, now);
            return all_of(*node, now).size();
        };
        EXPECT_EQ(get(*master, message(0x080, {})), 1U) << format;
        EXPECT_EQ(get(*stranger, message(0x000, {2, 0})), 0U) << format << ": NMT stop";
        EXPECT_EQ(get(*stranger, message(0x080, {})), 0U) << format;
        EXPECT_EQ(get(*stranger, message(0x205, {1, 2})), 0U) << format << ": a set-point";
        EXPECT_EQ(get(*stranger, message(0x605, {0x40})), 1U)
            << format << ": SDO may come from anybody";
        EXPECT_EQ(get(*master, message(0x000, {1, 0})), 1U) << format;
        EXPECT_EQ(node->statistics().rejected, 3U) << format;
        EXPECT_GE(master->statistics().rejected, 2U) << format << ": the master hears them, too";
        Rejected what;
        ASSERT_TRUE(node->rejected(what));
        EXPECT_EQ(what.why, Rejected::Why::not_the_master);
        EXPECT_EQ(what.count, 3U);
        EXPECT_NE(to_string(what).find(
                      "rejected NMT command (000h) from 02:48:41:4c:00:03: not the master"),
                  std::string::npos)
            << to_string(what);
        EXPECT_FALSE(node->rejected(what)) << "once a second";
    }
}

TEST(CaneLink, a_master_that_is_given_stays) {
    auto first = opened("cane:sim:given?mac=02:00:00:00:00:01");
    auto node = opened("cane:sim:given?master=02:00:00:00:00:02");
    auto second = opened("cane:sim:given?mac=02:00:00:00:00:02");
    first->send(message(0x000, {2, 0}), 0);
    first->flush(0);
    EXPECT_TRUE(all_of(*node, 1'000'000).empty()) << "though it was the first";
    second->send(message(0x000, {2, 0}), 2'000'000);
    second->flush(2'000'000);
    EXPECT_EQ(all_of(*node, 3'000'000).size(), 1U);
}

std::string key_file(const std::string& name, const std::string& digits, int mode = 0600) {
    const std::string file = testing::TempDir() + "cane-" + name + std::to_string(::getpid());
    std::ofstream(file) << digits << "\n";
    ::chmod(file.c_str(), static_cast<mode_t>(mode));
    return file;
}

TEST(CaneLink, signed_frames_pass_only_with_the_key_and_only_once) {
    const auto key = key_file("one", "000102030405060708090a0b0c0d0e0f");

    const auto other = key_file("two", "100102030405060708090a0b0c0d0e0f");
    auto master = opened("cane:sim:signed?key=" + key);
    auto node = opened("cane:sim:signed?key=" + key);
    auto with_other = opened("cane:sim:signed?key=" + other);
    auto with_none = opened("cane:sim:signed");
    auto listener = ethernet::open("sim:signed");
    std::int64_t now = 0;
    const auto get = [&](Link& from) {
        from.send(message(0x205, {1, 2, 3}), now);
        from.flush(now);
        return all_of(*node, now += 1'000'000).size();
    };
    EXPECT_EQ(get(*with_none), 0U);
    EXPECT_EQ(get(*with_other), 0U);
    EXPECT_EQ(get(*master), 1U);
    EXPECT_TRUE(all_of(*with_none, now).empty())
        << "one without a key does not take it for something else";
    Bytes seen;
    while (const auto arrival = listener.port->receive(now)) {
        seen.assign(arrival->bytes.begin(), arrival->bytes.end());
    }
    listener.port->send(seen, {}, now);
    EXPECT_TRUE(all_of(*node, now += 1'000'000).empty()) << "replayed";
    for (std::size_t at = 0; at < 14 + 18 + 5 + 8; ++at) {  // any bit of it changed
        if (at == 12 || at == 13) continue;
        auto forged = seen;
        forged[at] ^= 1;
        std::fill_n(forged.begin(), 6, std::uint8_t{0xff});
        listener.port->send(forged, {}, now);
        EXPECT_TRUE(all_of(*node, now += 1'000'000).empty()) << at;
    }
    EXPECT_EQ(get(*master), 1U);
    for (const auto* wrong : {"00", "000102030405060708090a0b0c0d0e0g", ""}) {
        EXPECT_NE(can::open("cane:sim:signed?key=" + key_file("bad", wrong)).problem, "");
    }
    EXPECT_NE(can::open("cane:sim:signed?key=" +
                        key_file("open", "000102030405060708090a0b0c0d0e0f", 0644))
                  .problem.find("chmod 600"),
              std::string::npos);
    EXPECT_NE(can::open("cane:sim:signed?format=single&key=" + key).problem, "");
}

TEST(CaneLink, what_a_tag_costs) {
    constexpr int turns = 200'000;
    const Key key{1, 2};
    for (const int messages : {1, 5, 20}) {
        Bytes whole(ethernet::max_frame);
        std::size_t plain = 14 + packed_header;
        std::size_t tagged = plain + counter_bytes;
        for (int n = 0; n < messages; ++n) {
            const auto f = message(0x201U + static_cast<unsigned>(n), {1, 2, 3, 4, 5, 6, 7, 8});
            plain += put_packed(f, std::span(whole).subspan(plain));
            tagged += 10;
        }
        const auto time = [&](auto work) {
            const auto began = std::chrono::steady_clock::now();
            for (int n = 0; n < turns; ++n) {
                work(static_cast<std::uint16_t>(n));
            }
            return std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() -
                                                            began)
                       .count() /
                   turns;
        };
        const std::span bytes(whole);
        begin_packed(bytes.first(plain), static_cast<std::uint8_t>(messages), 1, false);
        const double without =
            time([&](std::uint16_t n) { finish_packed(bytes.first(plain), n, 0, nullptr); });
        begin_packed(bytes.first(tagged + tag_bytes), static_cast<std::uint8_t>(messages), 1, true);
        const double with = time(
            [&](std::uint16_t n) { finish_packed(bytes.first(tagged + tag_bytes), n, n, &key); });
        std::printf(
            "%2d messages: a frame is finished in %.0f ns without, %.0f ns with a key, and is 16 "
            "bytes longer\n",
            messages, without, with);
    }
}

TEST(CaneLink, a_frame_that_its_sender_dropped_is_no_loss_of_the_wire) {
    auto x = opened("cane:sim:dropped/x");
    auto y = opened("cane:sim:dropped");
    auto port = ethernet::open("sim:dropped/x");
    auto& segment = *port.port->segment();
    std::int64_t now = 0;
    for (std::uint8_t n = 0; n < 20; ++n, now += 1'000'000) {
        segment.cut(segment.port(), n % 2 == 1);  // the sender has no line: it drops
        Frame f;
        x->receive(f, now);
        x->send(message(0x181, {n}), now);
        x->flush(now);
        all_of(*y, now + 500'000);
    }
    EXPECT_EQ(y->statistics().received, 10U);
    EXPECT_EQ(y->statistics().lost, 0U);
    EXPECT_EQ(x->statistics().dropped, 10U);
}

}  // namespace
}  // namespace hal::can::cane::test
