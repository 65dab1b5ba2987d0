// SPDX-License-Identifier: MIT
// Commands to the master, its reactions to failures, and its own objects of CiA 302.
#include "boot_bed.hpp"
#include "canopen/master/boot/master_objects.hpp"

namespace hal::canopen::test {
namespace {

TEST(BootNetwork, Stops_all_nodes_on_stop_all_and_leaves_them_stopped) {
    Three b([](std::uint8_t id, NodeSetup& n) {
        if (id == 6) {
            n.on_loss = Reaction::stop_all;
        }
    });
    b.power();
    b.start();
    ASSERT_TRUE(b.operational());
    b.stations[1]->plug(false, b.now);
    ASSERT_TRUE(b.until([&] { return b.master->status().state == NetworkState::failed; }, second));
    b.run(5 * second);
    EXPECT_EQ(b.state(0), NmtState::stopped);
    EXPECT_EQ(b.state(2), NmtState::stopped);
    EXPECT_EQ(b.own->state(), NmtState::pre_operational);
    EXPECT_EQ(b.master->sentence(),
              "the network is failed: node 6 sent no heartbeat within its timeout: check its power "
              "and cable; all nodes were stopped");
    EXPECT_EQ(b.master->sentence(5), "node 5 was stopped because of another node");
    b.stations[1]->plug(true, b.now);
    b.run(2 * second);
    EXPECT_EQ(b.state(1), NmtState::pre_operational);
    // who starts by himself is stopped again
    b.stations[0]->device.command(NmtCommand::start, b.now);
    b.run(200 * millisecond);
    EXPECT_EQ(b.state(0), NmtState::stopped);
    b.master->start(b.now);
    EXPECT_TRUE(b.operational());
}

TEST(BootNetwork, Resets_all_nodes_up_to_the_limit_and_then_stops_them) {
    Three b([](std::uint8_t id, NodeSetup& n) {
        if (id == 6) {
            n.on_failure = Reaction::reset_all;
            n.product = 99;
        }
    });
    b.power();
    b.start();
    ASSERT_TRUE(b.until([&] { return b.master->status().state == NetworkState::failed; }));
    EXPECT_EQ(b.master->status().resets, 3U);
    b.run(second);
    EXPECT_EQ(b.state(0), NmtState::stopped);
    EXPECT_EQ(b.stations[0]->resets.size(), 4U);
    EXPECT_EQ(b.master->status().node, 6);
}

TEST(BootNetwork, Carries_out_commands) {
    Three b;
    b.power();
    b.start();
    ASSERT_TRUE(b.operational());
    EXPECT_TRUE(b.master->command(NmtCommand::stop, 6, b.now));
    b.run(500 * millisecond);
    EXPECT_EQ(b.state(1), NmtState::stopped);
    EXPECT_EQ(b.status(6).step, Step::stopped);
    EXPECT_EQ(b.master->sentence(6), "node 6 was stopped by command");
    EXPECT_EQ(b.master->status().state, NetworkState::degraded);
    EXPECT_TRUE(b.master->command(NmtCommand::start, 6, b.now));
    ASSERT_TRUE(b.operational(second));
    EXPECT_EQ(b.status(6).attempts, 1U);

    b.stations[1]->plug(false, b.now);  // and it is watched as before
    ASSERT_TRUE(b.until([&] { return b.status(6).losses == 1; }, second));
    b.stations[1]->plug(true, b.now);
    ASSERT_TRUE(b.operational(second));
    const auto attempts = b.status(6).attempts;

    EXPECT_TRUE(b.master->command(NmtCommand::reset_node, 6, b.now));
    b.run(2 * millisecond);
    EXPECT_EQ(b.stations[1]->resets.back(), true);
    ASSERT_TRUE(b.operational(second));
    EXPECT_EQ(b.status(6).attempts, attempts + 1);

    EXPECT_TRUE(b.master->remove(6, b.now));
    b.run(500 * millisecond);
    EXPECT_EQ(b.state(1), NmtState::stopped);
    EXPECT_EQ(b.master->status().state, NetworkState::operational);
    EXPECT_EQ(b.master->status().mandatory, 2);
    EXPECT_TRUE(b.master->restart(6, b.now));
    ASSERT_TRUE(b.until([&] { return b.status(6).operational; }, second));

    EXPECT_TRUE(b.master->command(NmtCommand::enter_pre_operational, 0, b.now));
    b.run(500 * millisecond);
    for (std::size_t n = 0; n < 3; ++n) {
        EXPECT_EQ(b.state(n), NmtState::pre_operational);
    }
    EXPECT_TRUE(b.master->command(NmtCommand::start, 0, b.now));
    ASSERT_TRUE(b.operational(second));

    b.master->stop(b.now);
    b.run(500 * millisecond);
    for (std::size_t n = 0; n < 3; ++n) {
        EXPECT_EQ(b.state(n), NmtState::stopped);
    }
    EXPECT_EQ(b.master->sentence(), "the network is stopped: by command; 'start' boots it");
    b.master->start(b.now);
    EXPECT_TRUE(b.operational(second));
    EXPECT_FALSE(b.master->command(NmtCommand::start, 9, b.now));
}

TEST(BootNetwork, Detects_the_loss_of_a_stopped_node) {
    Three b;
    b.power();
    b.start();
    ASSERT_TRUE(b.operational());
    b.master->command(NmtCommand::stop, 0, b.now);
    b.run(second);
    EXPECT_TRUE(b.status(6).online);
    b.stations[1]->plug(false, b.now);
    b.run(second);
    EXPECT_FALSE(b.status(6).online);
    EXPECT_EQ(b.status(6).step, Step::stopped);
    EXPECT_TRUE(b.status(5).online);
}

TEST(BootNetwork, Does_not_configure_nodes_that_are_only_supervised) {
    Three b([](std::uint8_t id, NodeSetup& n) {
        n.configure = false;
        n.writes = {object_write(0x2000, 0, std::uint32_t{9})};
        if (id == 6) {
            n.heartbeat_limit = -1;
        }
        if (id == 7) {
            n.heartbeat_limit = 300 * millisecond;
            n.on_failure = Reaction::nothing;
        }
    });
    // sends a heartbeat of its own
    b.stations[0]->device.dictionary().set<std::uint16_t>(0x1017, 0, 30);
    b.stations[0]->device.dictionary().keep(0x1000, 0x1fff, false);
    b.power();
    b.start();
    ASSERT_TRUE(b.until([&] { return b.status(7).step == Step::failed; }));
    for (std::size_t n = 0; n < 3; ++n) {
        EXPECT_EQ(b.value(n, 0x2000, 0), 0x12345678U);
    }
    EXPECT_EQ(b.value(1, 0x1017, 0), 0U);
    EXPECT_TRUE(b.status(5).operational);
    EXPECT_EQ(b.status(5).notes, 0);
    EXPECT_TRUE(b.status(6).operational);  // as far as can be known
    EXPECT_EQ(note_sentences(b.setup.nodes[1], b.status(6))[0],
              "node 6 is not supervised: its loss will not be detected");
    EXPECT_EQ(b.state(1), NmtState::operational);
    EXPECT_EQ(b.status(7).result, BootResult::watching);
    b.stations[0]->plug(false, b.now);
    EXPECT_TRUE(b.until([&] { return b.status(5).losses == 1; }, second));
}

TEST(MasterObjects, Show_the_setup_and_accept_commands) {
    Three b([](std::uint8_t id, NodeSetup& n) {
        n.mandatory = id != 7;
        n.guard_ms = id == 7 ? 100 : 0;
    }, [](MasterSetup& s) { s.nmt_inhibit = millisecond; });
    Description d;
    add_master_objects(d, b.setup);
    Dictionary dictionary(d);
    EXPECT_TRUE(dictionary.problems().empty());
    MasterObjects objects(dictionary, *b.master);
    EXPECT_EQ(dictionary.get<std::uint16_t>(0x102a, 0), 10);
    EXPECT_EQ(dictionary.get<std::uint32_t>(0x1f80, 0), 1U);
    EXPECT_EQ(dictionary.get<std::uint32_t>(0x1f81, 5), 0xdU);
    EXPECT_EQ(dictionary.get<std::uint32_t>(0x1f81, 7), 0x640305U);
    EXPECT_EQ(dictionary.get<std::uint32_t>(0x1f85, 6), 1U);
    EXPECT_EQ(dictionary.get<std::uint32_t>(0x1f88, 6), 4U);
    EXPECT_EQ(dictionary.get<std::uint32_t>(0x1f89, 0), 3000U);
    NodeSetup again;
    apply_assignment(again, assignment_of(b.setup.nodes[2]));
    EXPECT_EQ(assignment_of(again), assignment_of(b.setup.nodes[2]));

    const auto state = [&](std::uint8_t id) {
        std::array<std::uint8_t, 4> buffer{};
        std::size_t size = 0;
        EXPECT_EQ(dictionary.read(0x1f82, id, buffer, size), Abort::none);
        return buffer[0];
    };
    const auto request = [&](std::uint8_t id, std::uint8_t what) {
        return dictionary.write(0x1f82, id, std::span(&what, 1));
    };
    EXPECT_EQ(state(6), 1);  // missing
    b.power();
    b.start();
    ASSERT_TRUE(b.operational());
    ASSERT_TRUE(b.until([&] { return b.status(7).operational; }));
    EXPECT_EQ(state(6), 5);
    EXPECT_EQ(request(6, 4), Abort::none);
    b.run(second);
    EXPECT_EQ(b.state(1), NmtState::stopped);
    EXPECT_EQ(state(6), 4);
    EXPECT_EQ(request(6, 5), Abort::none);
    ASSERT_TRUE(b.operational(second));
    for (const std::uint8_t reset : {std::uint8_t{6}, std::uint8_t{7}}) {
        EXPECT_EQ(request(6, reset), Abort::none);
        b.run(10 * millisecond);
        ASSERT_TRUE(b.operational(second));
    }
    EXPECT_EQ(b.stations[1]->resets.size(), 3U);
    EXPECT_EQ(request(128, 127), Abort::none);
    b.run(second);
    for (std::size_t n = 0; n < 3; ++n) {
        EXPECT_EQ(b.state(n), NmtState::pre_operational);
    }
    EXPECT_EQ(request(6, 3), Abort::value);
    EXPECT_EQ(request(9, 5), Abort::no_sub);
}

}  // namespace
}  // namespace hal::canopen::test
