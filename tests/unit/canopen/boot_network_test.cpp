// SPDX-License-Identifier: MIT
// Several nodes: mandatory ones, start order, loss and return, reactions, commands.
#include "boot_bed.hpp"
#include "canopen/master/boot/master_objects.hpp"

namespace hal::canopen::test {
namespace {

/// Example devices as nodes 5, 6, 7, each changed by `change`.
struct Three : Bed {
    explicit Three(const std::function<void(std::uint8_t, NodeSetup&)>& change = {}, const std::function<void(MasterSetup&)>& network = {})
        : Bed([&] {
              std::vector<NodeSetup> nodes;
              for (std::uint8_t id = 5; id <= 7; ++id) {
                  nodes.push_back(example_node(id));
                  if (change) change(id, nodes.back());
              }
              auto s = network_of(nodes);
              if (network) network(s);
              return s;
          }()) {
        for (std::uint8_t id = 5; id <= 7; ++id) add(id, example());
        bus.logging = true;
    }
    std::vector<std::uint8_t> started() const {
        std::vector<std::uint8_t> ids;
        for (const auto& f : bus.sent(0))
            if (f.data[0] == 1) ids.push_back(f.data[1]);
        return ids;
    }
};

TEST(BootNetwork, Boots_all_nodes_and_starts_them) {
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

TEST(BootNetwork, Starts_in_order) {
    Three b([](std::uint8_t id, NodeSetup& n) { n.start_order = 7U - id; });
    b.power();
    b.start();
    ASSERT_TRUE(b.operational(second));
    EXPECT_EQ(b.started(), (std::vector<std::uint8_t>{7, 6, 5}));
}

TEST(BootNetwork, Starts_all_with_one_command_when_all_mandatory_ones_are_ready) {
    Three b({}, [](MasterSetup& s) { s.start_all_at_once = true; });
    b.stations[0]->plug(true, b.now), b.stations[1]->plug(true, b.now);
    b.start();
    b.run(2 * second);
    EXPECT_TRUE(b.started().empty());
    EXPECT_EQ(b.status(5).step, Step::ready);
    b.stations[2]->plug(true, b.now);
    ASSERT_TRUE(b.operational());
    EXPECT_EQ(b.started(), (std::vector<std::uint8_t>{0}));
}

TEST(BootNetwork, Starts_nobody_who_must_not_be) {
    Three b([](std::uint8_t id, NodeSetup& n) {
        if (id == 6) n.vendor = 99, n.mandatory = false, n.on_failure = Reaction::nothing;
    }, [](MasterSetup& s) { s.start_all_at_once = true; });
    b.power();
    b.start();
    ASSERT_TRUE(b.operational());
    EXPECT_EQ(b.started(), (std::vector<std::uint8_t>{5, 7}));
    EXPECT_EQ(b.state(1), NmtState::pre_operational);
}

TEST(BootNetwork, Leaves_starting_to_others_where_told_so) {
    Three b([](std::uint8_t id, NodeSetup& n) { n.start = id != 6; });
    b.power();
    b.start();
    b.run(second);
    EXPECT_EQ(b.status(6).step, Step::running);
    EXPECT_FALSE(b.status(6).operational);
    EXPECT_EQ(b.master->status().state, NetworkState::booting);
    b.bus.inject({0, {1, 6}}, b.now);  // somebody does
    ASSERT_TRUE(b.operational(second));
    EXPECT_EQ(b.master->status().foreign_commands, 1U);
}

TEST(BootNetwork, Does_not_wait_for_an_optional_node) {
    Three b([](std::uint8_t id, NodeSetup& n) { n.mandatory = id != 6; });
    b.stations[0]->plug(true, b.now), b.stations[2]->plug(true, b.now);
    b.start();
    ASSERT_TRUE(b.operational(second));
    EXPECT_FALSE(b.status(6).operational);
    b.run(20 * second);
    EXPECT_EQ(b.status(6).result, BootResult::no_answer);
    b.stations[1]->plug(true, b.now);
    ASSERT_TRUE(b.until([&] { return b.status(6).operational; }, second));  // its boot-up message is enough
    EXPECT_EQ(b.networks, (std::vector{NetworkState::booting, NetworkState::operational}));
}

TEST(BootNetwork, Leaves_a_device_alone_that_is_not_the_expected_one_and_looks_for_another) {
    Three b([](std::uint8_t id, NodeSetup& n) {
        if (id == 6) n.product = 99;
    });
    b.power();
    b.start();
    b.run(30 * second);
    EXPECT_EQ(b.stations[1]->resets.size(), 1U);  // that at the start
    EXPECT_GT(b.status(6).attempts, 3U);
    EXPECT_EQ(b.status(6).result, BootResult::product);
    store(b.stations[1]->device.dictionary().find(0x1018, 2)->data, std::uint32_t{99});  // the right one is fitted
    EXPECT_TRUE(b.operational(5 * second));
}

TEST(BootNetwork, Waits_for_a_mandatory_node_and_says_for_which) {
    Three b;
    b.stations[0]->plug(true, b.now), b.stations[2]->plug(true, b.now);
    b.start();
    b.run(30 * second);
    EXPECT_EQ(b.master->status().state, NetworkState::booting);
    EXPECT_EQ(b.master->status().node, 6);
    EXPECT_EQ(progress(b.master->status()), "booting: 2 of 3 nodes operational, 1 failed or waited for");
    EXPECT_EQ(b.master->sentence(),
              "the network is booting: node 6 does not answer (1000:0): check its power, cable, bit rate and node id; "
              "'hal can scan' shows who is there [result B, no answer]; it is tried again");
    b.stations[1]->plug(true, b.now);
    EXPECT_TRUE(b.operational(second));
}

TEST(BootNetwork, Boots_few_at_a_time_where_told_so) {
    Three b({}, [](MasterSetup& s) { s.parallel = 1; });
    b.power();
    b.start();
    unsigned most = 0;
    ASSERT_TRUE(b.until([&] {
        most = std::max<unsigned>(most, static_cast<unsigned>(std::ranges::count_if(b.setup.nodes, [&](const NodeSetup& n) {
            const auto step = b.status(n.id).step;
            return step >= Step::resetting && step <= Step::watching;
        })));
        return b.master->status().state == NetworkState::operational;
    }));
    EXPECT_EQ(most, 1U);
}

TEST(BootNetwork, Keeps_the_inhibit_time_between_commands) {
    Three b({}, [](MasterSetup& s) { s.nmt_inhibit = 5 * millisecond; });
    b.power();
    b.start();
    std::vector<Time> at;
    std::size_t seen = 0;
    while (b.master->status().state != NetworkState::operational && b.now < 5 * second) {
        b.step();
        for (; seen < b.bus.sent(0).size(); ++seen) at.push_back(b.now);
    }
    ASSERT_EQ(at.size(), 4U);
    for (std::size_t n = 1; n < at.size(); ++n) EXPECT_GE(at[n] - at[n - 1] + b.dt, 5 * millisecond);
}

TEST(BootNetwork, Brings_a_power_cycled_node_back_while_the_others_run) {
    Three b([](std::uint8_t, NodeSetup& n) { n.writes = {object_write(0x2000, 0, std::uint32_t{9})}; });
    b.power();
    b.start();
    ASSERT_TRUE(b.operational());
    // Quickly: only its boot-up message tells.
    b.stations[1]->plug(false, b.now);
    b.run(10 * millisecond);
    b.stations[1]->plug(true, b.now);
    EXPECT_EQ(b.value(1, 0x2000, 0), 0x12345678U);
    b.run(2 * millisecond);
    EXPECT_EQ(b.master->status().state, NetworkState::degraded);
    EXPECT_EQ(b.status(6).losses, 1U);
    ASSERT_TRUE(b.operational(second));
    EXPECT_EQ(b.value(1, 0x2000, 0), 9U);
    EXPECT_EQ(b.status(6).retries, 1U);
    // For long: its heartbeat is missed.
    b.stations[1]->plug(false, b.now);
    const auto off = b.now;
    ASSERT_TRUE(b.until([&] { return !b.status(6).online; }));
    EXPECT_LE(b.now - off, 125 * millisecond + 2 * b.dt);
    EXPECT_EQ(b.master->sentence(),
              "the network is degraded: node 6 sent no heartbeat for its limit: check its power and cable; it is tried "
              "again");
    b.run(20 * second);
    b.stations[1]->plug(true, b.now);
    ASSERT_TRUE(b.operational(second));
    EXPECT_EQ(b.value(1, 0x2000, 0), 9U);
    for (const std::uint8_t other : {std::uint8_t{5}, std::uint8_t{7}}) {
        EXPECT_EQ(b.status(other).attempts, 1U);
        EXPECT_EQ(b.state(static_cast<std::size_t>(other) - 5), NmtState::operational);
    }
}

TEST(BootNetwork, Brings_a_node_back_that_left_operational_or_was_only_unplugged) {
    Three b;
    b.power();
    b.start();
    ASSERT_TRUE(b.operational());
    b.stations[0]->device.command(NmtCommand::enter_pre_operational, b.now);
    ASSERT_TRUE(b.until([&] { return b.status(5).losses == 1; }, second));
    EXPECT_EQ(b.status(5).cause, Cause::left_operational);
    EXPECT_EQ(b.master->sentence(5), "node 5 left operational by itself and is pre-operational");
    ASSERT_TRUE(b.until([&] { return b.status(5).operational; }, second));
    // The cable: the device goes on as if nothing were.
    auto& s = *b.stations[2];
    s.powered = false;
    b.run(5 * second);
    EXPECT_FALSE(b.status(7).online);
    s.powered = true;
    EXPECT_TRUE(b.until([&] { return b.status(7).operational; }, second));
}

TEST(BootNetwork, Backs_off_from_a_node_that_boots_again_and_again) {
    Three b;
    b.power();
    b.start();
    ASSERT_TRUE(b.operational());
    Frame boot_up = make_frame(0x706, 1);
    const auto attempts = b.status(6).attempts;
    const auto questions = b.bus.sent(0x606).size();
    b.stations[1]->delay = 4 * millisecond;  // no boot is over before the next of them
    for (int n = 0; n < 3000; ++n) b.bus.inject(boot_up, b.now), b.run(10 * millisecond);
    EXPECT_LE(b.status(6).attempts - attempts, 40U);
    EXPECT_LE(b.bus.sent(0x606).size() - questions, 40U * 9 * 6);
    EXPECT_EQ(b.status(6).cause, Cause::restarting);
    EXPECT_EQ(b.master->sentence(6).substr(0, 33), "node 6 booted again and again whi");
    EXPECT_TRUE(b.status(5).operational && b.status(7).operational);
    EXPECT_TRUE(b.operational());  // as soon as it is over
}

TEST(BootNetwork, Survives_several_boot_up_messages_and_none) {
    Three b;
    b.stations[0]->tamper = [&](const Frame& f) {
        if (f.id == 0x705 && f.data[0] == 0) b.stations[0]->wire.push(f), b.stations[0]->wire.push(f);
        return true;
    };
    b.stations[1]->tamper = [](const Frame& f) { return f.id != 0x706 || f.data[0] != 0; };
    b.power();
    b.start();
    EXPECT_TRUE(b.operational(3 * second));
    EXPECT_GE(b.status(5).boot_ups, 3U);
    EXPECT_EQ(b.status(6).boot_ups, 0U);
}

TEST(BootNetwork, Survives_power_cycles_at_any_moment_of_the_boot) {
    for (int moment = 1; moment < 40; ++moment) {
        Three b([](std::uint8_t, NodeSetup& n) {
            for (std::uint8_t sub = 1; sub <= 4; ++sub) n.writes.push_back(object_write(0x2008, sub, std::uint8_t{9}));
            n.writes[0] = object_write(0x2000, 0, std::uint32_t{9});
        });
        for (std::uint8_t sub = 1; sub <= 4; ++sub) b.stations[1]->device.dictionary().find(0x2008, sub)->access = Access::read_write;
        b.bus.logging = false;
        b.power();
        auto& s = *b.stations[1];
        s.delay = 3 * millisecond;  // so that moments differ
        b.start();
        b.run(moment * 4 * millisecond);
        s.plug(false, b.now);
        b.run(moment % 3 == 0 ? 700 * millisecond : 30 * millisecond);
        s.plug(true, b.now);
        ASSERT_TRUE(b.operational(20 * second)) << "moment " << moment << ": " << b.master->sentence() << " " << b.way(6);
        EXPECT_EQ(b.value(1, 0x2000, 0), 9U);
    }
}

TEST(BootNetwork, Survives_a_node_that_stays_initialising) {
    Three b;
    bool told = false;
    b.stations[1]->tamper = [&](Frame& f) {
        if (f.id != 0x706) return true;
        told = told || std::ranges::any_of(b.bus.sent(0), [](const Frame& c) { return c.data[0] == 0x80 && c.data[1] == 6; });
        if (!told && f.data[0] == 0x7f) f.data[0] = 0;
        return true;
    };
    b.power();
    b.start();
    EXPECT_TRUE(b.operational(5 * second)) << b.master->sentence();
    EXPECT_TRUE(told);
}

TEST(BootNetwork, Survives_late_answers_and_stale_aborts) {
    Three b;
    b.stations[0]->delay = 45 * millisecond;  // just in time
    b.stations[1]->delay = 70 * millisecond;  // each answer comes after the question was asked again
    int aborts = 0;
    b.stations[2]->tamper = [&](const Frame& f) {  // an abort of an earlier transfer goes ahead of every answer
        if (f.id == 0x587 && ++aborts > 1) b.stations[2]->wire.push({0x587, {0x80, 0x06, 0x20, 0, 1, 0, 4, 5}});
        return true;
    };
    b.power();
    b.start();
    EXPECT_TRUE(b.operational(20 * second)) << b.master->sentence();
    EXPECT_GT(b.status(6).sdo_retries, 0U);
    EXPECT_GT(b.master->network().node(7)->sdo().unexpected_responses(), 0U);
}

TEST(BootNetwork, Survives_wrong_toggle_bits) {
    Three b([](std::uint8_t id, NodeSetup& n) {
        if (id == 5) n.guard_ms = 20, n.guard_factor = 4;
        n.writes = {ObjectWrite{{0x2005, 0, std::vector<std::uint8_t>(30, 'x')}}};
    });
    int answers = 0;
    b.stations[0]->tamper = [&](Frame& f) {  // now and then an answer does not toggle
        if (f.id == 0x705 && ++answers % 9 == 0) f.data[0] ^= 0x80;
        return true;
    };
    int segments = 0;
    b.stations[1]->tamper = [&](Frame& f) {  // one answer to a segment in nine has the wrong one
        if (f.id == 0x586 && f.data[0] >> 5 <= 1 && ++segments % 9 == 0) f.data[0] ^= 0x10;
        return true;
    };
    b.stations[2]->tamper = [](Frame& f) {  // and all of this node's
        if (f.id == 0x587 && f.data[0] >> 5 <= 1) f.data[0] ^= 0x10;
        return true;
    };
    b.power();
    b.start();
    ASSERT_TRUE(b.until([&] { return b.status(5).operational && b.status(7).result != BootResult::none; }));
    EXPECT_GT(b.status(5).wrong_toggles, 0U);
    EXPECT_EQ(b.status(7).result, BootResult::configuration);
    EXPECT_EQ(b.master->sentence(7),
              "node 7 could not be talked to about object 2005:0 while it was configured: toggle bit not alternated "
              "(05030000h); something spoils its answers, or its SDO server is wrong [result J, configuration failed]");
    ASSERT_TRUE(b.until([&] { return b.status(6).operational; }));
    EXPECT_GT(b.status(6).sdo_retries, 0U);
    b.run(20 * second);
    EXPECT_EQ(b.status(5).losses, 0U);
    EXPECT_EQ(b.master->status().state, NetworkState::booting);
    EXPECT_EQ(b.master->status().node, 7);
}

TEST(BootNetwork, Starts_again_who_did_not_start) {
    Three b;
    int lost = 0;
    b.stations[0]->tamper = [&](const Frame& f) { return f.id != 0x705 || f.data[0] != 5 || ++lost > 6; };
    b.power();
    b.start();
    EXPECT_TRUE(b.operational());
    EXPECT_GT(std::ranges::count(b.started(), 5), 1);

    Three never([](std::uint8_t id, NodeSetup& n) {
        if (id == 6) n.on_failure = Reaction::nothing;
    });
    never.stations[1]->tamper = [](Frame& f) {
        if (f.id == 0x706 && f.data[0] == 5) f.data[0] = 0x7f;
        return true;
    };
    never.power();
    never.start();
    ASSERT_TRUE(never.until([&] { return never.status(6).step == Step::failed; }));
    EXPECT_EQ(never.master->sentence(6), "node 6 was told to start and is pre-operational; its error register is 00h");
}

TEST(BootNetwork, Stops_all_when_told_to_and_stays_so) {
    Three b([](std::uint8_t id, NodeSetup& n) {
        if (id == 6) n.on_loss = Reaction::stop_all;
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
              "the network is failed: node 6 sent no heartbeat for its limit: check its power and cable; all nodes were "
              "stopped");
    EXPECT_EQ(b.master->sentence(5), "node 5 was stopped because of another node");
    b.stations[1]->plug(true, b.now);
    b.run(2 * second);
    EXPECT_EQ(b.state(1), NmtState::pre_operational);
    b.stations[0]->device.command(NmtCommand::start, b.now);  // who starts by himself is stopped again
    b.run(200 * millisecond);
    EXPECT_EQ(b.state(0), NmtState::stopped);
    b.master->start(b.now);
    EXPECT_TRUE(b.operational());
}

TEST(BootNetwork, Resets_all_a_few_times_and_then_stops) {
    Three b([](std::uint8_t id, NodeSetup& n) {
        if (id == 6) n.on_failure = Reaction::reset_all, n.product = 99;
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

TEST(BootNetwork, Does_what_it_is_commanded) {
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
    for (std::size_t n = 0; n < 3; ++n) EXPECT_EQ(b.state(n), NmtState::pre_operational);
    EXPECT_TRUE(b.master->command(NmtCommand::start, 0, b.now));
    ASSERT_TRUE(b.operational(second));

    b.master->stop(b.now);
    b.run(500 * millisecond);
    for (std::size_t n = 0; n < 3; ++n) EXPECT_EQ(b.state(n), NmtState::stopped);
    EXPECT_EQ(b.master->sentence(), "the network is stopped: by command; 'start' boots it");
    b.master->start(b.now);
    EXPECT_TRUE(b.operational(second));
    EXPECT_FALSE(b.master->command(NmtCommand::start, 9, b.now));
}

TEST(BootNetwork, Knows_of_a_stopped_node_whether_it_is_there) {
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

TEST(BootNetwork, Does_not_configure_who_is_only_watched) {
    Three b([](std::uint8_t id, NodeSetup& n) {
        n.configure = false;
        n.writes = {object_write(0x2000, 0, std::uint32_t{9})};
        if (id == 6) n.heartbeat_limit = -1;
        if (id == 7) n.heartbeat_limit = 300 * millisecond, n.on_failure = Reaction::nothing;
    });
    b.stations[0]->device.dictionary().set<std::uint16_t>(0x1017, 0, 30);  // sends a heartbeat of its own
    b.stations[0]->device.dictionary().keep(0x1000, 0x1fff, false);
    b.power();
    b.start();
    ASSERT_TRUE(b.until([&] { return b.status(7).step == Step::failed; }));
    for (std::size_t n = 0; n < 3; ++n) EXPECT_EQ(b.value(n, 0x2000, 0), 0x12345678U);
    EXPECT_EQ(b.value(1, 0x1017, 0), 0U);
    EXPECT_TRUE(b.status(5).operational);
    EXPECT_EQ(b.status(5).notes, 0);
    EXPECT_TRUE(b.status(6).operational);  // as far as can be known
    EXPECT_EQ(note_sentences(b.setup.nodes[1], b.status(6))[0], "node 6 is not watched: its loss will not be noticed");
    EXPECT_EQ(b.state(1), NmtState::operational);
    EXPECT_EQ(b.status(7).result, BootResult::watching);
    b.stations[0]->plug(false, b.now);
    EXPECT_TRUE(b.until([&] { return b.status(5).losses == 1; }, second));
}

TEST(MasterObjects, Say_what_the_master_was_told_and_take_commands) {
    Three b([](std::uint8_t id, NodeSetup& n) { n.mandatory = id != 7, n.guard_ms = id == 7 ? 100 : 0; },
            [](MasterSetup& s) { s.nmt_inhibit = millisecond; });
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
        std::array<std::uint8_t, 4> room{};
        std::size_t size = 0;
        EXPECT_EQ(dictionary.read(0x1f82, id, room, size), Abort::none);
        return room[0];
    };
    const auto request = [&](std::uint8_t id, std::uint8_t what) { return dictionary.write(0x1f82, id, std::span(&what, 1)); };
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
    for (std::size_t n = 0; n < 3; ++n) EXPECT_EQ(b.state(n), NmtState::pre_operational);
    EXPECT_EQ(request(6, 3), Abort::value);
    EXPECT_EQ(request(9, 5), Abort::no_sub);
}

TEST(BootNetwork, Says_that_the_bus_takes_nothing_and_boots_when_it_does_again) {
    Three b;
    b.power();
    b.master->start(b.now);
    while (b.own->out().push(make_frame(0x7f0, 0))) {}  // the cable is out: what is queued stays
    const Time out = b.now;
    while (b.status(6).result == BootResult::none && b.now < out + 10 * second) b.now += b.dt, b.master->poll(b.now);
    EXPECT_EQ(b.status(6).cause, Cause::unsent);
    EXPECT_EQ(b.master->sentence(6),
              "node 6 could not be asked for 1000:0 while it was identified: the bus takes no frames from the master; check the master's "
              "cable, the bit rate, and that some node is there [result B, no answer]");
    b.own->out().clear();
    EXPECT_TRUE(b.operational());
}

TEST(BootNetwork, Tells_emergencies_and_keeps_the_newest) {
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

TEST(BootNetwork, Serves_the_application_while_it_boots) {
    Three b;
    b.power();
    std::array<std::uint8_t, 8> room{};
    SdoRequest read{.index = 0x2000, .upload = true, .room = room};
    b.start();
    b.step();
    ASSERT_TRUE(b.master->network().node(6)->sdo().submit(read));
    ASSERT_TRUE(b.operational());
    EXPECT_TRUE(read.ok());
    EXPECT_EQ(load<std::uint32_t>(room.data()), 0x12345678U);
}

}  // namespace
}  // namespace hal::canopen::test
