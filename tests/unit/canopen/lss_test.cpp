// SPDX-License-Identifier: MIT
// Layer setting services between our master and our devices, and what a master sees of nodes on the
// bus.
#include <gtest/gtest.h>

#include "bus.hpp"

namespace hal::canopen::test {
namespace {

struct Lss : testing::Test {
    Recorder events, master_events;
    Bus bus;
    std::vector<std::unique_ptr<Device>> devices;
    FrameQueue out{256};
    LssMaster master{out,
                     {.timeout = 20 * millisecond, .scan_timeout = 5 * millisecond, .repeats = 20}};
    Network network{out, master_events};
    Time now = 0;

    void SetUp() override {
        bus.attach(out, [this](const Frame& f, Time t) {
            if (master.listens_to(f)) {
                master.handle(f, t);
            } else {
                network.handle(f, t);
            }
        });
    }
    Device& add(std::uint32_t serial, std::uint8_t id = unconfigured) {
        devices.push_back(
            std::make_unique<Device>(example(serial), DeviceSettings{.node_id = id}, events));
        bus.attach(*devices.back());
        devices.back()->start(now);
        return *devices.back();
    }
    void run(Time ms) {
        for (Time n = 0; n < ms; ++n) {
            step();
        }
    }
    void step() {
        master.poll(now);
        network.poll(now);
        for (auto& d : devices) {
            d->poll(now);
        }
        bus.exchange(now);
        now += millisecond;
    }
    const LssMaster::Result& finish() {
        for (int n = 0; n < 100'000 && master.busy(); ++n) {
            step();
        }
        EXPECT_FALSE(master.busy());
        return master.result();
    }
};

TEST_F(Lss, Node_without_id_is_silent_until_it_has_got_one) {
    auto& d = add(7);
    run(5);
    EXPECT_TRUE(bus.log.empty());
    ASSERT_TRUE(master.identify_unconfigured(now));
    EXPECT_TRUE(finish().answered);
    ASSERT_TRUE(master.select({1, 2, 3, 7}, now));
    EXPECT_TRUE(finish().good());
    ASSERT_TRUE(master.inquire(3, now));
    EXPECT_EQ(finish().value, 7U);
    ASSERT_TRUE(master.inquire(4, now));
    EXPECT_EQ(finish().value, 255U);
    ASSERT_TRUE(master.configure_node_id(200, now));
    EXPECT_EQ(finish().error, 1);
    ASSERT_TRUE(master.configure_node_id(33, now));
    EXPECT_TRUE(finish().good());
    ASSERT_TRUE(master.store_configuration(now));
    EXPECT_TRUE(finish().good());
    EXPECT_TRUE(master.switch_global(false));
    run(2);
    EXPECT_EQ(d.node_id(), 33);
    EXPECT_EQ(d.state(), NmtState::pre_operational);
    EXPECT_EQ(bus.sent(0x721).size(), 1U);
    EXPECT_EQ(d.dictionary().get<std::uint32_t>(0x1400, 1), 0x221U);
}
TEST_F(Lss, Wrong_identity_selects_nobody) {
    add(7);
    ASSERT_TRUE(master.select({1, 2, 3, 8}, now));
    EXPECT_FALSE(finish().answered);
    ASSERT_TRUE(master.inquire(4, now));
    EXPECT_FALSE(finish().answered);
}
TEST_F(Lss, Identifies_a_range) {
    add(7, 5);
    ASSERT_TRUE(master.identify({1, 2, 0, 5}, {1, 2, 9, 9}, now));
    EXPECT_TRUE(finish().answered);
    ASSERT_TRUE(master.identify({1, 2, 0, 8}, {1, 2, 9, 9}, now));
    EXPECT_FALSE(finish().answered);
}
TEST_F(Lss, Configures_bit_timing) {
    add(7, 5);
    EXPECT_TRUE(master.switch_global(true));
    ASSERT_TRUE(master.configure_bit_timing(0, now));
    EXPECT_EQ(finish().error, 1);
    ASSERT_TRUE(master.configure_bit_timing(lss_bit_rate_index(500'000), now));
    EXPECT_TRUE(finish().good());
    EXPECT_TRUE(master.activate_bit_timing(100));
    run(1);
    EXPECT_EQ(events.activated_rate, 500'000U);
}
TEST_F(Lss, New_id_of_a_configured_node_holds_from_the_next_reset_on) {
    auto& d = add(7, 5);
    master.switch_global(true);
    ASSERT_TRUE(master.configure_node_id(6, now));
    EXPECT_TRUE(finish().good());
    master.switch_global(false);
    run(2);
    EXPECT_EQ(d.node_id(), 5);
    network.command(NmtCommand::reset_communication, 5);
    run(2);
    EXPECT_EQ(d.node_id(), 6);
}
TEST_F(Lss, Fastscan_finds_one_after_the_other) {
    const std::vector<std::uint32_t> serials = {0xdeadbeef, 1, 0x80000000, 0xffffffff, 0};
    for (const auto s : serials) {
        add(s);
    }
    std::vector<std::uint32_t> found;
    for (std::uint8_t id = 10; id < 20; ++id) {
        ASSERT_TRUE(master.scan(now));
        if (!finish().answered) break;
        found.push_back(master.result().identity[3]);
        ASSERT_TRUE(master.configure_node_id(id, now));
        EXPECT_TRUE(finish().good());
        master.switch_global(false);
        run(2);
    }
    EXPECT_EQ(found, (std::vector<std::uint32_t>{0, 1, 0x80000000, 0xdeadbeef, 0xffffffff}));
    EXPECT_GT(master.max_task_memory(), 0U);
    EXPECT_LT(master.max_task_memory(), LssMaster::task_bytes * 3 / 4);
}
TEST_F(Lss, Fastscan_survives_a_lost_answer_now_and_then) {
    add(0xdeadbeef);
    bus.faults.lose = 101;
    Time began = now;
    ASSERT_TRUE(master.scan(now));
    finish();
    EXPECT_TRUE(master.result().answered);
    EXPECT_EQ(master.result().identity[3], 0xdeadbeefU);
    EXPECT_LT(now - began, 60 * second);
}
TEST_F(Lss, Fastscan_of_known_numbers_is_short) {
    add(0xdeadbeef);
    const Time began = now;
    ASSERT_TRUE(master.scan(now, {1, 2, 3, 0}, {32, 32, 32, 0}));
    EXPECT_TRUE(finish().answered);
    EXPECT_LT(now - began, 250 * millisecond);
}

using Remote = Lss;
TEST_F(Remote, Heartbeat_and_emergencies_of_a_node_are_seen) {
    auto& d = add(7, 5);
    auto& node = network.add(5);
    node.expect_heartbeat(50 * millisecond);
    run(1);
    EXPECT_EQ(node.boot_ups(), 1U);
    d.dictionary().write(0x1017, 0, std::array<std::uint8_t, 2>{10, 0});
    run(30);
    EXPECT_EQ(node.state(), NmtState::pre_operational);
    network.command(NmtCommand::start, 5);
    run(30);
    EXPECT_EQ(node.state(), NmtState::operational);
    d.emcy().raise(0x4210, error_temperature);
    run(2);
    EXPECT_EQ(node.emergency(0).code, 0x4210);
    EXPECT_EQ(node.error_register(), 0x09);
    devices.clear();
    bus = {};
    run(60);
    EXPECT_TRUE(node.lost());
    EXPECT_EQ(master_events.nodes.back().event, NodeEvent::lost);
}
TEST_F(Remote, Guarding_sees_the_state_and_the_loss) {
    add(7, 5);
    auto& node = network.add(5);
    run(1);
    node.guard(10 * millisecond, 3, now);
    run(100);
    EXPECT_FALSE(node.lost());
    EXPECT_EQ(node.state(), NmtState::pre_operational);
    EXPECT_EQ(node.wrong_toggles(), 0U);
    bus.faults.lose = 1;
    run(40);
    EXPECT_TRUE(node.lost());
    bus.faults.lose = 0;
    run(30);
    EXPECT_FALSE(node.lost());
}

}  // namespace
}  // namespace hal::canopen::test
