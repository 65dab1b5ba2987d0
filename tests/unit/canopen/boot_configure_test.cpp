// SPDX-License-Identifier: MIT
// What is written to a node, and what is not.
#include "boot_bed.hpp"

namespace hal::canopen::test {
namespace {

struct Configured : Bed {
    explicit Configured(const std::function<void(NodeSetup&)>& change = {}, Description d = example(), bool auto_start = false)
        : Bed([&] {
              auto n = example_node();
              if (change) change(n);
              return network_of({n});
          }()),
          station(add(5, d, auto_start)) {
        bus.logging = true;
        power();
    }
    /// SDO requests with that command specifier to that object; 0: any.
    std::size_t requests(unsigned specifier, std::uint16_t index = 0) const {
        const auto sent = bus.sent(0x605);
        return static_cast<std::size_t>(std::ranges::count_if(sent, [&](const Frame& f) {
            return f.data[0] >> 5 == specifier && (index == 0 || load<std::uint16_t>(f.data.data() + 1) == index);
        }));
    }
    std::size_t writes(std::uint16_t index = 0) const { return requests(1, index); }
    std::size_t reads(std::uint16_t index = 0) const { return requests(2, index); }
    Station& station;
};
void two_objects(NodeSetup& n) {
    n.writes = {object_write(0x2000, 0, std::uint32_t{9}, "gain"), object_write(0x2001, 0, std::int16_t{-5}, "offset")};
}

TEST(Configure, Writes_what_differs_and_reads_it_back) {
    Configured b([](NodeSetup& n) {
        two_objects(n);
        n.writes.push_back(object_write(0x2008, 1, std::uint8_t{1}));  // holds that already
    });
    b.start();
    ASSERT_TRUE(b.operational());
    EXPECT_EQ(b.value(0, 0x2000, 0), 9U);
    EXPECT_EQ(b.station.device.dictionary().get<std::int16_t>(0x2001, 0), -5);
    EXPECT_EQ(b.writes(), 3U);  // with 1017h
    EXPECT_EQ(b.reads(0x2000), 2U);
    EXPECT_EQ(b.reads(0x2008), 1U);
    EXPECT_EQ(b.status(5).written, 3U);
}

TEST(Configure, Writes_nothing_when_nothing_differs) {
    auto d = example();
    d.find(0x2000, 0)->value = {9, 0, 0, 0};
    d.find(0x2001, 0)->value = {0xfb, 0xff};
    d.find(0x1017, 0)->value = {50, 0};
    Configured b(two_objects, d);
    b.start();
    ASSERT_TRUE(b.operational());
    EXPECT_EQ(b.writes(), 0U);
    EXPECT_EQ(b.reads(), 5U + 3U);  // the identity, two objects, 1017h
    EXPECT_EQ(b.bus.sent(0x605).size(), 8U);
    EXPECT_EQ(b.status(5).compared, 3U);
    EXPECT_EQ(b.status(5).written, 0U);
}

TEST(Configure, Maps_a_PDO_in_the_order_that_devices_demand) {
    const PdoDescription wished{.cob = 0x385, .transmission = 1, .mapping = {map_entry(0x2008, 1, 8), map_entry(0x2000, 0, 32)}};
    Configured b([&](NodeSetup& n) { n.writes = rpdo_writes(1, wished); });
    b.start();
    ASSERT_TRUE(b.operational());
    EXPECT_EQ(b.value(0, 0x1400, 1), 0x385U);
    EXPECT_EQ(b.value(0, 0x1400, 2), 1U);
    EXPECT_EQ(b.value(0, 0x1600, 0), 2U);
    EXPECT_EQ(b.value(0, 0x1600, 2), map_entry(0x2000, 0, 32));
    std::string order;
    for (const auto& f : b.bus.sent(0x605))
        if (f.data[0] >> 5 == 1 && f.data[2] != 0x10)
            order += std::to_string(f.data[2]) + '.' + std::to_string(f.data[3]) + '=' +
                     std::to_string(load<std::uint32_t>(f.data.data() + 4)) + ' ';
    EXPECT_EQ(order, "20.1=2147484549 22.0=0 22.1=537395464 22.2=536870944 22.0=2 20.2=1 20.3=0 20.5=0 20.1=901 ");
    // The second time it is as wished, and nothing of it is touched.
    b.bus.log.clear();
    const auto before = b.station.device.pdos().rpdo(1).count;
    b.master->restart(5, b.now);
    b.station.device.dictionary().keep(0x1000, 0x1fff, false);  // as if it had been saved
    ASSERT_TRUE(b.until([&] { return b.status(5).attempts == 2 && b.status(5).operational; }));
    EXPECT_EQ(b.writes(), 0U);
    EXPECT_EQ(b.station.device.pdos().rpdo(1).count, before);
}

TEST(Configure, Makes_the_writes_of_a_PDO) {
    const auto text = [](const std::vector<ObjectWrite>& writes) {
        std::string result;
        for (const auto& w : writes) {
            std::uint32_t value = 0;
            std::memcpy(&value, w.data.data(), w.data.size());
            char line[80];
            std::snprintf(line, sizeof line, "%04x:%u=%x%s ", w.index, unsigned{w.sub}, value, w.optional ? "?" : "");
            result += line;
        }
        return result;
    };
    EXPECT_EQ(text(tpdo_writes(2, {.event_ms = 10, .mapping = {map_entry(0x6041, 0, 16)}}, 5)),
              "1801:1=80000285 1a01:0=0 1a01:1=60410010 1a01:0=1 1801:2=ff 1801:3=0? 1801:5=a 1801:6=0? 1801:1=285 ");
    EXPECT_EQ(text(rpdo_writes(3, {.cob = 0x400, .plus_node_id = true, .mapping = {map_entry(0x6040, 0, 16)}}, 5)),
              "1402:1=80000405 1602:0=0 1602:1=60400010 1602:0=1 1402:2=ff 1402:3=0? 1402:5=0? 1402:1=405 ");
    EXPECT_EQ(text(tpdo_writes(5, {.mapping = {map_entry(0x6041, 0, 16)}}, 5)),
              "1804:1=80000000 1a04:0=0 1a04:1=60410010 1a04:0=1 1804:2=ff 1804:3=0? 1804:5=0? 1804:6=0? ");
    EXPECT_EQ(text(rpdo_writes(1, {}, 5)), "1400:1=80000205 ");
    EXPECT_EQ(rpdo_writes(1, {}, 5)[0].name, "RPDO1 COB-ID");
    const std::array<std::uint8_t, 4> off{0, 0, 0, 0x80}, other_off{1, 2, 0, 0x80}, on{5, 2, 0, 0}, no_rtr{5, 2, 0, 0x40};
    EXPECT_TRUE(same_value(0x1400, 1, off, other_off));
    EXPECT_FALSE(same_value(0x1400, 1, off, on));
    EXPECT_FALSE(same_value(0x1400, 1, on, off));
    EXPECT_TRUE(same_value(0x1800, 1, on, no_rtr));
    EXPECT_FALSE(same_value(0x2000, 1, on, no_rtr));
    EXPECT_FALSE(same_value(0x2000, 1, on, std::span(on).first(2)));
}

TEST(Configure, Writes_unread_what_cannot_be_read) {
    Configured b([](NodeSetup& n) { n.writes = {object_write(0x2003, 0, std::uint8_t{3}), object_write(0x2000, 0, std::uint32_t{5})}; });
    Spoil refuses;
    refuses.read = [](Entry&) { return Abort::access; };
    b.station.device.dictionary().handle(0x2000, refuses);
    b.start();
    ASSERT_TRUE(b.operational());
    EXPECT_EQ(b.reads(0x2003), 1U);
    EXPECT_EQ(b.writes(0x2003), 1U);
    EXPECT_EQ(b.reads(0x2000), 1U);
    EXPECT_EQ(b.value(0, 0x2000, 0), 5U);
}

TEST(Configure, Leaves_out_what_the_node_need_not_have) {
    Configured b([](NodeSetup& n) {
        n.writes = {object_write(0x5000, 0, std::uint8_t{0})};
        n.writes[0].optional = true;
    });
    b.start();
    EXPECT_TRUE(b.operational());
    EXPECT_EQ(b.writes(0x5000), 0U);
}

TEST(Configure, Takes_a_node_out_of_operational_when_it_started_itself) {
    Configured b(two_objects, example(), true);
    Spoil refuses;
    refuses.write = [&](Entry&, std::span<const std::uint8_t>) {
        return b.station.device.state() == NmtState::operational ? Abort::device_state : Abort::none;
    };
    b.station.device.dictionary().handle(0x2000, refuses);
    b.start();
    ASSERT_TRUE(b.operational());
    EXPECT_EQ(b.value(0, 0x2000, 0), 9U);
    EXPECT_EQ(b.status(5).attempts, 1U);
}

TEST(Configure, Survives_a_node_that_leaves_pre_operational_meanwhile) {
    auto d = example();
    d.find(0x1017, 0)->value = {50, 0};
    Configured b(two_objects, d);
    Spoil refuses;
    int refused = 0;
    refuses.write = [&](Entry&, std::span<const std::uint8_t>) {
        if (refused++ == 0) b.station.device.command(NmtCommand::start, b.now), b.station.poll(b.now);
        return b.station.device.state() == NmtState::operational ? Abort::device_state : Abort::none;
    };
    b.station.device.dictionary().handle(0x2001, refuses);
    b.start();
    ASSERT_TRUE(b.operational());
    EXPECT_EQ(b.value(0, 0x2000, 0), 9U);
    EXPECT_GE(refused, 2);
}

TEST(Configure, Is_skipped_when_date_and_time_agree) {
    auto d = example();
    using enum Access;
    d.add(0x1020, 0, Type::unsigned8, constant, 2);
    d.add(0x1020, 1, Type::unsigned32, read_write);
    d.add(0x1020, 2, Type::unsigned32, read_write);
    const auto dated = [](NodeSetup& n) {
        two_objects(n);
        n.configuration_date = 14000, n.configuration_time = 5000;
        n.save = true;
    };
    Configured b(dated, d);
    b.start();
    ASSERT_TRUE(b.operational());
    EXPECT_EQ(b.value(0, 0x1020, 1), 14000U);
    EXPECT_EQ(b.station.stored, 1);
    b.bus.log.clear();
    b.master->restart(5, b.now);
    ASSERT_TRUE(b.until([&] { return b.status(5).attempts == 2 && b.status(5).operational; }));
    EXPECT_EQ(b.reads(0x2000), 0U);
    EXPECT_EQ(b.writes(), 0U);
    EXPECT_EQ(b.value(0, 0x2000, 0), 9U);
    EXPECT_EQ(b.station.stored, 1);

    Configured without(dated);  // a device without 1020h
    without.start();
    ASSERT_TRUE(without.operational());
    EXPECT_EQ(without.status(5).notes, note_no_date);
    EXPECT_EQ(without.value(0, 0x2000, 0), 9U);
}

TEST(Configure, Waits_for_a_slow_node_as_long_as_it_is_told_to) {
    const auto boots = [](Time own, int resends) {
        Configured b([&](NodeSetup& n) { n.sdo_timeout = own, n.sdo_resends = resends, n.heartbeat_limit = -1; });
        b.station.delay = 700 * millisecond;  // longer than the master's own patience
        b.start();
        return b.operational(20 * second);
    };
    EXPECT_FALSE(boots(0, -1));
    EXPECT_TRUE(boots(second, 0));
    EXPECT_FALSE(boots(500 * millisecond, 0));
    EXPECT_TRUE(boots(500 * millisecond, 2));
}

TEST(Configure, Restores_defaults_first_and_saves_last) {
    Configured b([](NodeSetup& n) {
        n.writes = {object_write(0x2001, 0, std::int16_t{7})};
        n.restore = n.save = true;
    });
    b.station.device.dictionary().set<std::uint32_t>(0x2000, 0, 1);
    b.station.device.dictionary().keep(0x2000, 0x2fff, false);  // spoilt by somebody
    b.start();
    ASSERT_TRUE(b.operational());
    EXPECT_EQ(b.value(0, 0x2000, 0), 0x12345678U);
    EXPECT_EQ(b.station.restored, 1);
    EXPECT_EQ(b.station.stored, 1);
    EXPECT_EQ(b.way(5),
              "queued, resetting, identifying, configuring, restoring its defaults, resetting, identifying, configuring, saving, "
              "waiting for its heartbeat, ready, starting, running");
    EXPECT_EQ(b.station.resets, (std::vector{false, true}));
}

TEST(Configure, Guards_a_node_without_heartbeat) {
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

TEST(Configure, Guards_where_it_is_told_to_and_the_node_watches_the_master) {
    Configured b([](NodeSetup& n) { n.guard_ms = 20, n.guard_factor = 3; });
    b.start();
    ASSERT_TRUE(b.operational());
    EXPECT_EQ(b.station.device.dictionary().get<std::uint16_t>(0x1017, 0), 0);
    b.alive = false;
    b.own->out().clear();
    b.run(100 * millisecond);
    EXPECT_EQ(b.station.life, (std::vector{true}));
    EXPECT_EQ(b.state(0), NmtState::pre_operational);
}

TEST(Configure, Loses_a_guarded_node_whose_toggle_bit_never_changes) {
    Configured b([](NodeSetup& n) { n.guard_ms = 20, n.guard_factor = 3; });
    b.start();
    ASSERT_TRUE(b.operational());
    b.station.tamper = [](Frame& f) {
        if (f.id == 0x705) f.data[0] &= 0x7f;
        return true;
    };
    const Time stuck = b.now;
    ASSERT_TRUE(b.until([&] { return b.status(5).losses == 1; }, second));
    EXPECT_LE(b.now - stuck, 80 * millisecond + b.dt);  // its life time and the answer before
    EXPECT_EQ(b.status(5).cause, Cause::guard_toggle);
    EXPECT_EQ(b.master->sentence(5),
              "node 5 answered guarding with a toggle bit that did not change for its limit: its answers do not count; watch it by "
              "heartbeat, or look for two devices with this id");
    b.run(10 * second);
    EXPECT_NE(b.master->status().state, NetworkState::operational);
    b.station.tamper = nullptr;
    EXPECT_TRUE(b.operational());
}

TEST(Configure, Lets_devices_fall_to_their_safe_state_when_the_master_dies) {
    auto d = example();
    d.add(0x1016, 1, Type::unsigned32, Access::read_write, 0x00210100);  // watches another node already: the next entry is taken
    Configured b([](NodeSetup& n) { n.master_limit_ms = 150; }, d);
    b.start();
    ASSERT_TRUE(b.operational());
    b.run(second);
    EXPECT_EQ(b.station.communication_errors, 0);
    std::size_t entries = 0;
    for (std::uint8_t n = 1; n <= 4; ++n)
        if (b.value(0, 0x1016, n) == (127U << 16 | 150)) ++entries;
    EXPECT_EQ(entries, 1U);
    b.alive = false;
    b.own->out().clear();
    b.run(149 * millisecond + 51 * millisecond);
    EXPECT_EQ(b.station.communication_errors, 1);
    EXPECT_EQ(b.state(0), NmtState::pre_operational);
    // The master comes back: it sees that the node left operational and brings it in again.
    b.alive = true;
    ASSERT_TRUE(b.until([&] { return b.status(5).losses >= 1 && b.status(5).operational; }));
    EXPECT_EQ(b.state(0), NmtState::operational);
}

TEST(Configure, Notes_a_node_that_cannot_watch_the_master) {
    auto d = example();
    std::erase_if(d.entries, [](const EntryDescription& e) { return e.index == 0x1016; });
    Configured b([](NodeSetup& n) { n.master_limit_ms = 150; }, d);
    b.start();
    ASSERT_TRUE(b.operational());
    EXPECT_EQ(b.status(5).notes, note_no_consumer);
    EXPECT_EQ(note_sentences(b.setup.nodes[0], b.status(5))[0],
              "node 5 has no free entry in 1016 and does not notice when the master is gone");
}

TEST(Configure, Takes_the_heartbeat_period_that_the_node_can_do) {
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

    Configured late([](NodeSetup& n) { n.heartbeat_limit = 60 * millisecond, n.on_failure = Reaction::nothing; });
    spoil(late);
    ASSERT_TRUE(late.ended(5));
    EXPECT_EQ(late.status(5).result, BootResult::configuration);
    EXPECT_EQ(late.status(5).cause, Cause::not_taken);
}

TEST(Configure, Writes_the_heartbeat_period_again_when_no_heartbeat_came) {
    auto d = example();
    d.find(0x1017, 0)->value = {50, 0};
    Configured b({}, d);
    b.station.tamper = [&](const Frame& f) { return f.id != 0x705 || f.data[0] == 0 || b.writes(0x1017) != 0; };
    b.start();
    ASSERT_TRUE(b.operational());
    EXPECT_EQ(b.status(5).attempts, 2U);
    EXPECT_EQ(b.writes(), 1U);
}

TEST(Configure, Writes_long_values) {
    Configured b([](NodeSetup& n) {
        ObjectWrite text{{0x2005, 0, {}}}, domain{{0x2006, 0, std::vector<std::uint8_t>(5000, 0x5a)}};
        for (const char c : std::string("a name of more than one segment")) text.data.push_back(static_cast<std::uint8_t>(c));
        n.writes = {text, domain};
    });
    b.start();
    ASSERT_TRUE(b.operational());
    EXPECT_EQ(b.station.device.dictionary().find(0x2005, 0)->size, 31U);
    EXPECT_EQ(b.station.device.dictionary().find(0x2006, 0)->size, 5000U);
    EXPECT_EQ(b.status(5).written, 3U);
}

TEST(Configure, Takes_a_concise_DCF) {
    const std::vector<eds::Write> writes{{0x2000, 0, {1, 0, 0, 0}}, {0x2001, 0, {2, 0}}};
    const auto parsed = eds::parse_concise(eds::concise(writes));
    ASSERT_TRUE(parsed);
    Configured b([&](NodeSetup& n) { n.writes = object_writes(*parsed); });
    b.start();
    ASSERT_TRUE(b.operational());
    EXPECT_EQ(b.value(0, 0x2000, 0), 1U);
}

TEST(Setup, Takes_the_objects_of_CiA_302) {
    MasterSetup s = network_of({example_node(5), example_node(6)});
    apply_assignment(s.nodes[0], 0x0064'0309 | 1U << 4 | 1U << 6 | 1U << 7);  // guarded at 100 ms, mandatory, not booted
    EXPECT_TRUE(s.nodes[0].mandatory && s.nodes[0].keep_alive && s.nodes[0].program.update && s.nodes[0].restore);
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

TEST(Setup, Says_what_cannot_be) {
    auto s = network_of({example_node(5), example_node(5), example_node(127), example_node(0)});
    s.nodes[0].writes = {ObjectWrite{{0x6083, 0, {}}}};
    s.nodes[0].guard_ms = 10, s.nodes[0].guard_factor = 0;
    s.nodes[0].heartbeat_limit = 50 * millisecond;
    EXPECT_EQ(
        problems_of(s),
        (std::vector<std::string>{
            "node 5 gets no value for object 6083:0; give it one or take the object out", "node 5 is guarded with the factor 0; 3 is usual",
            "node 5 is lost after 50 ms of silence but sends its heartbeat every 50 ms; the limit has to be longer",
            "node 5 is there twice; every node has an id of its own", "node 127 has the master's own id; give one of the two another",
            "node 0 cannot be: node ids are 1 to 127"}));
    FrameQueue out(8);
    MasterEvents events;
    EXPECT_THROW(Master(s, out, events), std::invalid_argument);
    EXPECT_TRUE(problems_of(network_of({example_node(5)})).empty());
}

}  // namespace
}  // namespace hal::canopen::test
