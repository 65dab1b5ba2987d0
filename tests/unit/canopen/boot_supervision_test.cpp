// SPDX-License-Identifier: MIT
// Heartbeat and node guarding as the master sets them up; the set-up of a master.
#include "boot_bed.hpp"

namespace hal::canopen::test {
namespace {

TEST(Supervision, Guards_a_node_without_heartbeat) {
    auto d = example();
    std::erase_if(d.entries, [](const EntryDescription& e) { return e.index == 0x1017; });
    Configured b({}, d);
    b.start();
    ASSERT_TRUE(b.operational());
    EXPECT_EQ(b.status(5).notes, note_guarded);
    EXPECT_EQ(b.station.device.dictionary().get<std::uint16_t>(0x100c, 0), 50);
    EXPECT_EQ(b.station.device.dictionary().get<std::uint8_t>(0x100d, 0), 3);
    b.station.plug(false, b.now);
    ASSERT_TRUE(b.until([&] { return b.status(5).losses == 1; }, second));
    EXPECT_EQ(b.networks.back(), NetworkState::degraded);
    EXPECT_EQ(b.status(5).cause, Cause::guarding);
    b.station.plug(true, b.now);
    EXPECT_TRUE(b.operational());
}

TEST(Supervision, Guards_when_so_configured_and_the_node_monitors_the_master) {
    Configured b([](NodeSetup& n) {
        n.guard_ms = 20;
        n.guard_factor = 3;
    });
    b.start();
    ASSERT_TRUE(b.operational());
    EXPECT_EQ(b.station.device.dictionary().get<std::uint16_t>(0x1017, 0), 0);
    b.alive = false;
    b.own->out().clear();
    b.run(100 * millisecond);
    EXPECT_EQ(b.station.life, (std::vector{true}));
    EXPECT_EQ(b.state(0), NmtState::pre_operational);
}

TEST(Supervision, Reports_a_guarded_node_whose_toggle_bit_never_changes) {
    Configured b([](NodeSetup& n) {
        n.guard_ms = 20;
        n.guard_factor = 3;
    });
    b.start();
    ASSERT_TRUE(b.operational());
    b.station.tamper = [](Frame& f) {
        if (f.id == 0x705) {
            f.data[0] &= 0x7f;
        }
        return true;
    };
    const Time stuck = b.now;
    ASSERT_TRUE(b.until([&] { return b.status(5).losses == 1; }, second));
    EXPECT_LE(b.now - stuck, 80 * millisecond + b.dt);  // its life time and the answer before
    EXPECT_EQ(b.status(5).cause, Cause::guard_toggle);
    EXPECT_EQ(b.master->sentence(5),
              "node 5 responded to node guarding with a toggle bit that did not alternate: "
              "supervise it by heartbeat, or look for a "
              "second device with this node ID");
    b.run(10 * second);
    EXPECT_NE(b.master->status().state, NetworkState::operational);
    b.station.tamper = nullptr;
    EXPECT_TRUE(b.operational());
}

TEST(Supervision, Lets_devices_enter_their_safe_state_when_the_master_stops) {
    auto d = example();
    // watches another node already: the next entry is taken
    d.add(0x1016, 1, Type::unsigned32, Access::read_write, 0x00210100);
    Configured b([](NodeSetup& n) { n.master_limit_ms = 150; }, d);
    b.start();
    ASSERT_TRUE(b.operational());
    b.run(second);
    EXPECT_EQ(b.station.communication_errors, 0);
    std::size_t entries = 0;
    for (std::uint8_t n = 1; n <= 4; ++n) {
        if (b.value(0, 0x1016, n) == (127U << 16 | 150)) {
            ++entries;
        }
    }
    EXPECT_EQ(entries, 1U);
    b.alive = false;
    b.own->out().clear();
    b.run(149 * millisecond + 51 * millisecond);
    EXPECT_EQ(b.station.communication_errors, 1);
    EXPECT_EQ(b.state(0), NmtState::pre_operational);
    // The master resumes, detects that the node left the operational state, and boots it again.
    b.alive = true;
    ASSERT_TRUE(b.until([&] { return b.status(5).losses >= 1 && b.status(5).operational; }));
    EXPECT_EQ(b.state(0), NmtState::operational);
}

TEST(Supervision, Notes_a_node_that_cannot_monitor_the_master) {
    auto d = example();
    std::erase_if(d.entries, [](const EntryDescription& e) { return e.index == 0x1016; });
    Configured b([](NodeSetup& n) { n.master_limit_ms = 150; }, d);
    b.start();
    ASSERT_TRUE(b.operational());
    EXPECT_EQ(b.status(5).notes, note_no_consumer);
    EXPECT_EQ(note_sentences(b.setup.nodes[0], b.status(5))[0],
              "node 5 has no free entry in 1016 and cannot detect the loss of the master");
}

TEST(Supervision, Accepts_the_nearest_heartbeat_period_the_node_supports) {
    Spoil rounds;
    const auto spoil = [&](Configured& b) {
        rounds.after = [&](Entry& e) {
            store(e.data, std::uint16_t{64});
            static_cast<Handler&>(b.station.device.error_control()).written(e);
        };
        b.station.device.dictionary().handle(0x1017, rounds);
        b.start();
    };
    Configured b;
    spoil(b);
    EXPECT_TRUE(b.operational());

    Configured late([](NodeSetup& n) {
        n.heartbeat_limit = 60 * millisecond;
        n.on_failure = Reaction::nothing;
    });
    spoil(late);
    ASSERT_TRUE(late.ended(5));
    EXPECT_EQ(late.status(5).result, BootResult::configuration);
    EXPECT_EQ(late.status(5).cause, Cause::not_retained);
}

TEST(Supervision, Writes_the_heartbeat_period_again_when_no_heartbeat_arrived) {
    auto d = example();
    d.find(0x1017, 0)->value = {50, 0};
    Configured b({}, d);
    b.station.tamper = [&](const Frame& f) {
        return f.id != 0x705 || f.data[0] == 0 || b.writes(0x1017) != 0;
    };
    b.start();
    ASSERT_TRUE(b.operational());
    EXPECT_EQ(b.status(5).attempts, 2U);
    EXPECT_EQ(b.writes(), 1U);
}

TEST(Setup, Applies_1F80h_and_1F81h) {
    MasterSetup s = network_of({example_node(5), example_node(6)});
    // guarded at 100 ms, mandatory, not booted
    apply_assignment(s.nodes[0], 0x0064'0309 | 1U << 4 | 1U << 6 | 1U << 7);
    EXPECT_TRUE(s.nodes[0].mandatory && s.nodes[0].keep_alive && s.nodes[0].program.update &&
                s.nodes[0].restore);
    EXPECT_FALSE(s.nodes[0].configure || s.nodes[0].start);
    EXPECT_EQ(s.nodes[0].guard_ms, 100);
    EXPECT_EQ(s.nodes[0].guard_factor, 3);
    apply_assignment(s.nodes[1], 5);
    EXPECT_TRUE(s.nodes[1].configure && s.nodes[1].start && !s.nodes[1].mandatory);
    apply_startup(s, 1U << 1 | 1U << 2 | 1U << 6);
    EXPECT_TRUE(s.start_all_at_once && !s.start_self);
    EXPECT_EQ(s.nodes[0].on_loss, Reaction::stop_all);
    EXPECT_EQ(s.nodes[1].on_loss, Reaction::restart);
}

TEST(Setup, Rejects_impossible_values) {
    auto s = network_of({example_node(5), example_node(5), example_node(127), example_node(0)});
    s.nodes[0].writes = {ObjectWrite{{0x6083, 0, {}}}};
    s.nodes[0].guard_ms = 10;
    s.nodes[0].guard_factor = 0;
    s.nodes[0].heartbeat_limit = 50 * millisecond;
    EXPECT_EQ(problems_of(s),
              (std::vector<std::string>{
                  "node 5 has no value for object 6083:0; enter one or remove the object",
                  "node 5 has the life time factor 0; 3 is usual",
                  "node 5 has a heartbeat timeout of 50 ms, not longer than its heartbeat period "
                  "of 50 ms; use a longer timeout",
                  "node 5 is configured twice: duplicate node ID; change one of them",
                  "node 127 has the node ID of the master; change one of them",
                  "node 0 has an invalid node ID; use 1 to 127"}));
    FrameQueue out(8);
    MasterEvents events;
    EXPECT_THROW(Master(s, out, events), std::invalid_argument);
    EXPECT_TRUE(problems_of(network_of({example_node(5)})).empty());
}

}  // namespace
}  // namespace hal::canopen::test
