// SPDX-License-Identifier: MIT
// Synchronization 01 to 10 of the conformance test, against our device.
#include "conformance.hpp"

namespace hal::canopen::test {
namespace {

using enum NmtCommand;

struct ConformanceSync : Conformance {
    static constexpr std::uint32_t produce = 0x40000080;
    std::vector<int> counters(Time ms) {
        bus.log.clear();
        run(ms);
        std::vector<int> all;
        for (const auto& f : since(0x80)) {
            all.push_back(f.length == 1 ? f.data[0] : -static_cast<int>(f.length));
        }
        return all;
    }
};

TEST_F(ConformanceSync, Sync_01_default_identifier) { EXPECT_EQ(get(0x1005, 0), 0x80U); }
TEST_F(ConformanceSync, Sync_02_as_many_as_the_period_says) {
    EXPECT_EQ(put(0x1006, 0, 100'000), Abort::none);
    EXPECT_EQ(put(0x1005, 0, produce), Abort::none);
    EXPECT_NEAR(static_cast<double>(counters(10'000).size()), 100, 1);
}
TEST_F(ConformanceSync, Sync_03_own_syncs_send_the_synchronous_pdos) {
    put(0x1006, 0, 100'000);
    put(0x1005, 0, produce);
    operational();
    bus.log.clear();
    run(10'000);
    EXPECT_NEAR(static_cast<double>(count(0x285)), 100, 1);
}
TEST_F(ConformanceSync, Sync_04_consumer_with_a_period_of_zero_follows_whoever_sends) {
    EXPECT_EQ(put(0x1005, 0, 0x80), Abort::none);
    EXPECT_EQ(put(0x1006, 0, 0), Abort::none);
    operational();
    EXPECT_EQ(count_of_syncs(0x285, 7), 7U);
    EXPECT_EQ(count_in(0x80, 1000), 0U);
    EXPECT_EQ(events.syncs_lost, 0);
}
TEST_F(ConformanceSync, Sync_05_overflow_of_one_and_above_240_is_invalid) {
    for (const std::uint32_t value : {1U, 241U, 255U}) {
        EXPECT_EQ(put(0x1019, 0, value), Abort::value) << value;
    }
    for (const std::uint32_t value : {2U, 240U, 0U}) {
        EXPECT_EQ(put(0x1019, 0, value), Abort::none) << value;
    }
}
TEST_F(ConformanceSync, Sync_06_without_a_counter_a_sync_is_empty) {
    EXPECT_EQ(put(0x1019, 0, 0), Abort::none);
    put(0x1006, 0, 10'000);
    put(0x1005, 0, produce);
    const auto all = counters(100);
    EXPECT_NEAR(static_cast<double>(all.size()), 10, 1);
    for (const int c : all) {
        EXPECT_EQ(c, 0);
    }
}
TEST_F(ConformanceSync, Sync_07_counter_runs_from_one_to_its_overflow) {
    EXPECT_EQ(put(0x1019, 0, 5), Abort::none);
    put(0x1006, 0, 10'000);
    put(0x1005, 0, produce);
    const auto all = counters(140);
    ASSERT_GE(all.size(), 12U);
    for (std::size_t n = 0; n < all.size(); ++n) {
        EXPECT_EQ(all[n], static_cast<int>(n % 5 + 1));
    }
    nmt(stop);
    EXPECT_TRUE(counters(100).empty());
    nmt(enter_pre_operational);
    EXPECT_EQ(counters(10).at(0), 1) << "it begins anew";
}
TEST_F(ConformanceSync, Sync_08_counter_that_was_stored_is_there_after_a_reset) {
    put(0x1019, 0, 5);
    put(0x1006, 0, 10'000);
    put(0x1005, 0, produce);
    EXPECT_EQ(write(0x1010, 1, 0x65766173, 4), Abort::none);
    nmt(reset_node);
    EXPECT_EQ(get(0x1019, 0), 5U);
    const auto all = counters(60);
    ASSERT_GE(all.size(), 5U);
    EXPECT_EQ(all[4], 5);
}
TEST_F(ConformanceSync, Sync_09_counter_is_not_changed_while_there_is_a_period) {
    put(0x1006, 0, 10'000);
    EXPECT_EQ(put(0x1019, 0, 5), Abort::device_state);
    put(0x1006, 0, 0);
    EXPECT_EQ(put(0x1019, 0, 5), Abort::none);
}
TEST_F(ConformanceSync, Sync_10_values_that_were_stored_outlast_the_reset_of_communication) {
    put(0x1005, 0, 0x90);
    put(0x1006, 0, 0);
    put(0x1019, 0, 5);
    EXPECT_EQ(write(0x1010, 1, 0x65766173, 4), Abort::none);
    nmt(reset_communication);
    EXPECT_EQ(get(0x1005, 0), 0x90U);
    EXPECT_EQ(get(0x1019, 0), 5U);
    operational();
    bus.log.clear();
    send({0x80, {1}});
    EXPECT_EQ(count(0x285), 0U);
    send({0x90, {1}});
    EXPECT_EQ(count(0x285), 1U);
}

}  // namespace
}  // namespace hal::canopen::test
