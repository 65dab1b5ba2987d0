// SPDX-License-Identifier: MIT
// Stations on a segment that damages frames, and under random frames.
#include <gtest/gtest.h>

#include "wire.hpp"

namespace tdma_tests {
namespace {

constexpr Time ms = 1'000'000;

/// Each kind of damage to every 7th frame is ignored, and the station continues.
class Station_with_every_7th_frame_damaged : public testing::TestWithParam<const char*> {};
TEST_P(Station_with_every_7th_frame_damaged, counts_it_and_keeps_its_slots) {
    const std::string what = GetParam();
    Bed bed;
    bed.wire.noise_ns = 300;
    Machine& m = bed.add(1, master());
    Machine& s = bed.add(2, slave(300'000), {100e-6, 4'000'000});
    bed.wire.fault = [&, n = 0](Wire::Frame& f) mutable {
        if (++n % 7 != 0) return true;
        if (what == "lost") return false;
        if (what == "delayed") {
            f.arrives = 2'300'000;
        }
        if (what == "cut") {
            f.bytes.resize(static_cast<std::size_t>(n / 7) % 60);
        }
        if (what == "garbled") {
            f.bytes[bed.wire.random() % 60] = static_cast<std::uint8_t>(bed.wire.random());
        }
        if (what == "version") {
            f.bytes[n % 2 == 0 ? 16 : 18] ^= 4;
        }
        if (what == "random") {
            for (std::size_t i = 14; i < 60; ++i) {
                f.bytes[i] = static_cast<std::uint8_t>(bed.wire.random());
            }
        }
        if (what == "doubled") {
            Wire::Frame again = f;
            again.arrives = 0;
            again.left += 400'000;
            ++n;
            bed.wire.queue(again);
        }
        return true;
    };
    bed.run(1500 * ms);
    ASSERT_TRUE(s.station.ready()) << what;
    EXPECT_EQ(0, s.events[Event::sync_lost]) << what;
    EXPECT_EQ(0, m.events[Event::withdrew]);
    EXPECT_NEAR(static_cast<double>(Wire::path), static_cast<double>(s.status().delay), 1'000)
        << what;
    double worst = 0;
    s.in_cycle = [&](Machine& x) {
        const Time t = x.port.clock().real(x.next);
        worst = std::max(worst, std::abs(static_cast<double>(x.station.global(x.next) -
                                                             m.port.clock().local(t))));
    };
    bed.run(1000 * ms);
    EXPECT_LT(worst, 2'000) << what << ": global time is right all the time";
    EXPECT_EQ(0, s.events[Event::sync_lost]) << what;
    if (what == "cut" || what == "version") {
        EXPECT_GT(s.status().count.foreign, 50U) << what;
    }
    if (what == "lost") {
        EXPECT_GT(s.status().count.syncs_lost, 50U);
    }
}
INSTANTIATE_TEST_SUITE_P(damage, Station_with_every_7th_frame_damaged,
                         testing::Values("lost", "doubled", "delayed", "cut", "garbled", "version",
                                         "random"),
                         [](const auto& one) { return std::string(one.param); });

TEST(Station, keeps_its_slots_under_random_frames) {
    Bed bed;
    Machine& m = bed.add(1, master());
    Machine& s = bed.add(2, slave(300'000));
    Machine& b = bed.add(3, backup(100'000, 500'000));
    for (int i = 0; i < 20'000; ++i) {
        std::vector<std::uint8_t> frame(bed.wire.random() % 80);
        for (auto& byte : frame) {
            byte = static_cast<std::uint8_t>(bed.wire.random());
        }
        if (frame.size() > 22) {
            std::fill_n(frame.begin(), 6, std::uint8_t{0xff});
            const std::uint8_t head[] = {
                0x90, 0x21, 0, 1, 2,
                0,    2,    1, 0, static_cast<std::uint8_t>(i % 3 == 0 ? 0 : 0x10 + i % 2)};
            std::copy(std::begin(head), std::end(head), frame.begin() + 12);
            // in the master's name
            if (i % 5 == 0) {
                std::copy_n(mac(1).begin(), 6, frame.begin() + 6);
            }
        }
        bed.wire.inject(std::move(frame), 8, 700 * ms + i * 20'000);
    }
    bed.run(1300 * ms);
    EXPECT_TRUE(m.status().leading && m.station.ready());
    EXPECT_EQ(0, m.events[Event::withdrew]);
    EXPECT_EQ(0, s.events[Event::sync_lost] + b.events[Event::sync_lost]);
    EXPECT_TRUE(s.station.ready() && b.station.ready());
    EXPECT_LT(std::abs(s.status().error), 1'000);
}

}  // namespace
}  // namespace tdma_tests
