// SPDX-License-Identifier: MIT
// Several nodes boot side by side: mandatory and optional ones, start order, NMT inhibit time.
#include "boot_bed.hpp"

namespace hal::canopen::test {
namespace {

TEST(BootNetwork, Boots_and_starts_all_nodes) {
    Three b;
    b.power();
    b.start();
    ASSERT_TRUE(b.operational(second));
    const auto commands = b.bus.sent(0);
    ASSERT_FALSE(commands.empty());
    EXPECT_EQ(commands[0].data[0], 0x82);  // one reset for all
    EXPECT_EQ(commands[0].data[1], 0);
    EXPECT_EQ(b.master->status().mandatory, 3);
    EXPECT_EQ(b.master->status().operational, 3);
}

TEST(BootNetwork, Starts_nodes_in_their_start_order) {
    Three b([](std::uint8_t id, NodeSetup& n) { n.start_order = 7U - id; });
    b.power();
    b.start();
    ASSERT_TRUE(b.operational(second));
    EXPECT_EQ(b.started(), (std::vector<std::uint8_t>{7, 6, 5}));
}

TEST(BootNetwork, Starts_all_nodes_with_one_command_once_all_mandatory_nodes_are_ready) {
    Three b({}, [](MasterSetup& s) { s.start_all_at_once = true; });
    b.stations[0]->plug(true, b.now);
    b.stations[1]->plug(true, b.now);
    b.start();
    b.run(2 * second);
    EXPECT_TRUE(b.started().empty());
    EXPECT_EQ(b.status(5).step, Step::ready);
    b.stations[2]->plug(true, b.now);
    ASSERT_TRUE(b.operational());
    EXPECT_EQ(b.started(), (std::vector<std::uint8_t>{0}));
}

TEST(BootNetwork, Does_not_start_nodes_that_are_not_ready_or_removed) {
    Three b([](std::uint8_t id, NodeSetup& n) {
        if (id == 6) {
            n.vendor = 99;
            n.mandatory = false;
            n.on_failure = Reaction::nothing;
        }
    }, [](MasterSetup& s) { s.start_all_at_once = true; });
    b.power();
    b.start();
    ASSERT_TRUE(b.operational());
    EXPECT_EQ(b.started(), (std::vector<std::uint8_t>{5, 7}));
    EXPECT_EQ(b.state(1), NmtState::pre_operational);
}

TEST(BootNetwork, Leaves_the_start_to_others_when_so_configured) {
    Three b([](std::uint8_t id, NodeSetup& n) { n.start = id != 6; });
    b.power();
    b.start();
    b.run(second);
    EXPECT_EQ(b.status(6).step, Step::running);
    EXPECT_FALSE(b.status(6).operational);
    EXPECT_EQ(b.master->status().state, NetworkState::booting);
    b.bus.inject({0, {1, 6}}, b.now);  // another NMT master sends the command
    ASSERT_TRUE(b.operational(second));
    EXPECT_EQ(b.master->status().foreign_commands, 1U);
}

TEST(BootNetwork, Does_not_wait_for_an_optional_node) {
    Three b([](std::uint8_t id, NodeSetup& n) { n.mandatory = id != 6; });
    b.stations[0]->plug(true, b.now);
    b.stations[2]->plug(true, b.now);
    b.start();
    ASSERT_TRUE(b.operational(second));
    EXPECT_FALSE(b.status(6).operational);
    b.run(20 * second);
    EXPECT_EQ(b.status(6).result, BootResult::no_answer);
    b.stations[1]->plug(true, b.now);
    // its boot-up message is enough
    ASSERT_TRUE(b.until([&] { return b.status(6).operational; }, second));
    EXPECT_EQ(b.networks, (std::vector{NetworkState::booting, NetworkState::operational}));
}

TEST(BootNetwork, Does_not_reset_a_mismatching_device_and_keeps_looking_for_the_right_one) {
    Three b([](std::uint8_t id, NodeSetup& n) {
        if (id == 6) {
            n.product = 99;
        }
    });
    b.power();
    b.start();
    b.run(30 * second);
    EXPECT_EQ(b.stations[1]->resets.size(), 1U);  // that at the start
    EXPECT_GT(b.status(6).attempts, 3U);
    EXPECT_EQ(b.status(6).result, BootResult::product);
    // the right one is fitted
    store(b.stations[1]->device.dictionary().find(0x1018, 2)->data, std::uint32_t{99});
    EXPECT_TRUE(b.operational(5 * second));
}

TEST(BootNetwork, Waits_for_a_mandatory_node_and_names_it) {
    Three b;
    b.stations[0]->plug(true, b.now);
    b.stations[2]->plug(true, b.now);
    b.start();
    b.run(30 * second);
    EXPECT_EQ(b.master->status().state, NetworkState::booting);
    EXPECT_EQ(b.master->status().node, 6);
    EXPECT_EQ(progress(b.master->status()),
              "booting: 2 of 3 nodes operational, 1 failed or waiting");
    EXPECT_EQ(b.master->sentence(),
              "the network is booting: node 6 does not respond (1000:0): check its power, cable, "
              "bit rate and node ID; 'hal can scan' "
              "lists the nodes that respond [result B, no response]; retrying");
    b.stations[1]->plug(true, b.now);
    EXPECT_TRUE(b.operational(second));
}

TEST(BootNetwork, Limits_the_number_of_nodes_booted_at_a_time) {
    Three b({}, [](MasterSetup& s) { s.parallel = 1; });
    b.power();
    b.start();
    unsigned max = 0;
    ASSERT_TRUE(b.until([&] {
        max = std::max<unsigned>(max, static_cast<unsigned>(std::ranges::count_if(
                                          b.setup.nodes, [&](const NodeSetup& n) {
            const auto step = b.status(n.id).step;
            return step >= Step::resetting && step <= Step::watching;
        })));
        return b.master->status().state == NetworkState::operational;
    }));
    EXPECT_EQ(max, 1U);
}

TEST(BootNetwork, Keeps_the_NMT_inhibit_time_between_commands) {
    Three b({}, [](MasterSetup& s) { s.nmt_inhibit = 5 * millisecond; });
    b.power();
    b.start();
    std::vector<Time> at;
    std::size_t seen = 0;
    while (b.master->status().state != NetworkState::operational && b.now < 5 * second) {
        b.step();
        for (; seen < b.bus.sent(0).size(); ++seen) {
            at.push_back(b.now);
        }
    }
    ASSERT_EQ(at.size(), 4U);
    for (std::size_t n = 1; n < at.size(); ++n) {
        EXPECT_GE(at[n] - at[n - 1] + b.dt, 5 * millisecond);
    }
}

TEST(BootNetwork, Reports_emergencies_and_keeps_the_newest) {
    Three b;
    b.power();
    b.start();
    ASSERT_TRUE(b.operational());
    b.stations[1]->device.emcy().raise(0x4310, error_temperature);
    b.run(5 * millisecond);
    EXPECT_EQ(b.status(6).emergency.code, 0x4310);
    EXPECT_EQ(b.status(6).error_register, error_temperature | error_generic);
    EXPECT_EQ(b.status(6).emergencies, 1U);
    ASSERT_EQ(b.emergencies.size(), 1U);
    EXPECT_EQ(b.emergencies[0].first, 6);
}

TEST(BootNetwork, Serves_requests_of_the_application_while_booting) {
    Three b;
    b.power();
    std::array<std::uint8_t, 8> buffer{};
    SdoRequest read{.index = 0x2000, .upload = true, .buffer = buffer};
    b.start();
    b.step();
    ASSERT_TRUE(b.master->network().node(6)->sdo().submit(read));
    ASSERT_TRUE(b.operational());
    EXPECT_TRUE(read.ok());
    EXPECT_EQ(load<std::uint32_t>(buffer.data()), 0x12345678U);
}

}  // namespace
}  // namespace hal::canopen::test
