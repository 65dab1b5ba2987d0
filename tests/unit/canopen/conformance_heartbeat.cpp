// SPDX-License-Identifier: MIT
// Guarding 01 to 06, Heartbeat 01 to 07 and Heartbeat versus guarding 01 to 07 of the conformance
// test, against our device.
#include "conformance.hpp"

namespace hal::canopen::test {
namespace {

using enum NmtCommand;

struct ConformanceErrorControl : Conformance {
    /// The answer to a guarding request; -1: none.
    int guarded() {
        bus.log.clear();
        send(Frame::request(0x705, 1));
        run(1);
        for (const auto& f : since(0x705)) {
            if (!f.remote) return f.data[0];
        }
        return -1;
    }
    void life(std::uint16_t ms, std::uint8_t factor) {
        put(0x100c, 0, ms);
        put(0x100d, 0, factor);
    }
};

TEST_F(ConformanceErrorControl, Guarding_01_100Ch_and_100Dh_are_there) {
    EXPECT_EQ(read_abort(0x100c, 0), Abort::none);
    EXPECT_EQ(read_abort(0x100d, 0), Abort::none);
}
TEST_F(ConformanceErrorControl, Guarding_02_remote_request_is_answered_with_the_state) {
    EXPECT_EQ(guarded() & 0x7f, 0x7f);
    nmt(start);
    EXPECT_EQ(guarded() & 0x7f, 5);
    nmt(stop);
    EXPECT_EQ(guarded() & 0x7f, 4);
}
TEST_F(ConformanceErrorControl, Guarding_03_toggle_bit_alternates_from_zero_after_a_reset) {
    for (int round = 0; round < 2; ++round) {
        nmt(reset_communication);
        for (int n = 0; n < 6; ++n) {
            EXPECT_EQ(guarded() >> 7, n % 2) << n;
        }
    }
}
TEST_F(ConformanceErrorControl, Guarding_04_only_the_own_identifier_is_answered) {
    for (std::uint32_t id = 0x701; id <= 0x77f; ++id) {
        bus.log.clear();
        send(Frame::request(id, 1));
        run(1);
        std::size_t answers = 0;
        for (const auto& f : bus.log) {
            answers += f.remote ? 0 : 1;
        }
        EXPECT_EQ(answers, id == 0x705 ? 1U : 0U) << std::hex << id;
    }
}
TEST_F(ConformanceErrorControl, Guarding_05_100Ch_and_100Dh_are_written) {
    EXPECT_EQ(put(0x100c, 0, 500), Abort::none);
    EXPECT_EQ(put(0x100d, 0, 3), Abort::none);
    EXPECT_EQ(get(0x100c, 0), 500U);
    EXPECT_EQ(get(0x100d, 0), 3U);
}
TEST_F(ConformanceErrorControl, Guarding_06_silence_of_the_master_is_a_life_guarding_event) {
    life(50, 3);
    nmt(start);
    run(500);
    EXPECT_TRUE(events.life.empty()) << "it begins with the first request";
    for (int n = 0; n < 10; ++n) {
        guarded();
        run(40);
    }
    EXPECT_TRUE(events.life.empty());
    run(149);
    EXPECT_EQ(events.life, (std::vector<bool>{true}));
    EXPECT_TRUE(device->emcy().active(0x8130));
    EXPECT_EQ(device->state(), NmtState::pre_operational);
}

TEST_F(ConformanceErrorControl, Heartbeat_01_1017h_is_written) {
    EXPECT_EQ(put(0x1017, 0, 100), Abort::none);
    EXPECT_EQ(get(0x1017, 0), 100U);
}
TEST_F(ConformanceErrorControl, Heartbeat_02_as_many_as_the_period_says) {
    put(0x1017, 0, 100);
    EXPECT_NEAR(static_cast<double>(count_in(0x705, 10'000)), 100, 1);
}
TEST_F(ConformanceErrorControl, Heartbeat_03_none_with_a_period_of_zero) {
    put(0x1017, 0, 100);
    run(500);
    put(0x1017, 0, 0);
    EXPECT_EQ(count_in(0x705, 5000), 0U);
}
TEST_F(ConformanceErrorControl, Heartbeat_04_one_node_is_not_consumed_twice) {
    EXPECT_EQ(put(0x1016, 1, 9 << 16 | 100), Abort::none);
    EXPECT_EQ(put(0x1016, 2, 9 << 16 | 100), Abort::incompatible);
    EXPECT_EQ(put(0x1016, 1, 9 << 16 | 200), Abort::none) << "its own entry is not another one";
    EXPECT_EQ(put(0x1016, 2, 10 << 16 | 100), Abort::none);
}
TEST_F(ConformanceErrorControl, Heartbeat_05_consumer_is_content_with_a_faster_producer) {
    put(0x1016, 1, 9 << 16 | 100);
    nmt(start);
    for (int n = 0; n < 100; ++n) {
        send({0x709, {5}});
        run(50);
    }
    EXPECT_EQ(events.communication_errors, 0);
    EXPECT_EQ(device->state(), NmtState::operational);
}
TEST_F(ConformanceErrorControl, Heartbeat_06_consumer_notices_a_slower_producer) {
    put(0x1016, 1, 9 << 16 | 100);
    nmt(start);
    send({0x709, {5}});
    bus.log.clear();
    run(150);
    EXPECT_EQ(events.communication_errors, 1);
    ASSERT_EQ(count(0x085), 1U);
    EXPECT_EQ(load<std::uint16_t>(since(0x085)[0].data.data()), 0x8130);
    send({0x709, {5}});
    run(1);
    EXPECT_EQ(load<std::uint16_t>(since(0x085).back().data.data()), 0) << "and its return";
}
TEST_F(ConformanceErrorControl, Heartbeat_07_consumer_starts_anew_after_a_boot_up_of_the_producer) {
    put(0x1016, 1, 9 << 16 | 100);
    nmt(start);
    send({0x709, {5}});
    run(50);
    send({0x709, {0}});
    run(500);
    EXPECT_EQ(events.communication_errors, 0) << "it may take its time until the first heartbeat";
    send({0x709, {0x7f}});
    run(150);
    EXPECT_EQ(events.communication_errors, 1);
    bus.log.clear();
    nmt(reset_node);
    run(1);
    EXPECT_EQ(count(0x705), 1U) << "and the boot-up of the device itself";
}

TEST_F(ConformanceErrorControl, Versus_01_both_sets_of_objects_are_there) {
    for (const std::uint16_t index :
         {std::uint16_t{0x100c}, std::uint16_t{0x100d}, std::uint16_t{0x1017}}) {
        EXPECT_EQ(read_abort(index, 0), Abort::none);
    }
}
TEST_F(ConformanceErrorControl, Versus_02_heartbeat_switched_off) {
    put(0x1017, 0, 0);
    EXPECT_EQ(count_in(0x705, 1000), 0U);
}
TEST_F(ConformanceErrorControl, Versus_03_guarding_without_heartbeat) {
    put(0x1017, 0, 0);
    life(100, 3);
    for (int n = 0; n < 4; ++n) {
        EXPECT_EQ(guarded(), n % 2 != 0 ? 0xff : 0x7f);
    }
}
TEST_F(ConformanceErrorControl, Versus_04_heartbeat_without_guarding) {
    life(0, 0);
    put(0x1017, 0, 50);
    EXPECT_NEAR(static_cast<double>(count_in(0x705, 1000)), 20, 1);
}
TEST_F(ConformanceErrorControl, Versus_05_remote_requests_beside_a_heartbeat_get_no_answer) {
    life(0, 0);
    put(0x1017, 0, 1000);
    run(1);
    for (int n = 0; n < 5; ++n) {
        EXPECT_EQ(guarded(), -1);
    }
}
TEST_F(ConformanceErrorControl, Versus_06_with_both_the_heartbeat_counts) {
    life(50, 3);
    put(0x1017, 0, 50);
    EXPECT_NEAR(static_cast<double>(count_in(0x705, 1000)), 20, 1);
    for (const auto& f : since(0x705)) {
        EXPECT_EQ(f.data[0] >> 7, 0);
    }
}
TEST_F(ConformanceErrorControl,
       Versus_07_with_both_requests_are_ignored_and_life_guarding_never_begins) {
    life(50, 3);
    put(0x1017, 0, 1000);
    run(1);
    for (int n = 0; n < 5; ++n) {
        EXPECT_EQ(guarded(), -1);
    }
    run(900);
    EXPECT_TRUE(events.life.empty());
    EXPECT_EQ(events.communication_errors, 0);
}

}  // namespace
}  // namespace hal::canopen::test
