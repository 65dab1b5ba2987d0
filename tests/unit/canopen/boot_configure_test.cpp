// SPDX-License-Identifier: MIT
// The configuration of a node: which objects are written, and which are not.
#include "boot_bed.hpp"

namespace hal::canopen::test {
namespace {

TEST(Configure, Writes_differing_objects_and_reads_them_back) {
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

TEST(Configure, Maps_a_PDO_in_the_order_of_CiA_301) {
    const PdoDescription wished{.cob = 0x385,
                                .transmission = 1,
                                .mapping = {map_entry(0x2008, 1, 8), map_entry(0x2000, 0, 32)}};
    Configured b([&](NodeSetup& n) { n.writes = rpdo_writes(1, wished); });
    b.start();
    ASSERT_TRUE(b.operational());
    EXPECT_EQ(b.value(0, 0x1400, 1), 0x385U);
    EXPECT_EQ(b.value(0, 0x1400, 2), 1U);
    EXPECT_EQ(b.value(0, 0x1600, 0), 2U);
    EXPECT_EQ(b.value(0, 0x1600, 2), map_entry(0x2000, 0, 32));
    std::string order;
    for (const auto& f : b.bus.sent(0x605)) {
        if (f.data[0] >> 5 == 1 && f.data[2] != 0x10) {
            order += std::to_string(f.data[2]) + '.' + std::to_string(f.data[3]) + '=' +
                     std::to_string(load<std::uint32_t>(f.data.data() + 4)) + ' ';
        }
    }
    EXPECT_EQ(order,
              "20.1=2147484549 22.0=0 22.1=537395464 22.2=536870944 22.0=2 20.2=1 20.3=0 20.5=0 "
              "20.1=901 ");
    // The second time it is as wished, and nothing of it is touched.
    b.bus.log.clear();
    const auto before = b.station.device.pdos().rpdo(1).count;
    b.master->restart(5, b.now);
    b.station.device.dictionary().keep(0x1000, 0x1fff, false);  // as if it had been saved
    ASSERT_TRUE(b.until([&] { return b.status(5).attempts == 2 && b.status(5).operational; }));
    EXPECT_EQ(b.writes(), 0U);
    EXPECT_EQ(b.station.device.pdos().rpdo(1).count, before);
}

TEST(Configure, Generates_the_writes_of_a_PDO) {
    const auto text = [](const std::vector<ObjectWrite>& writes) {
        std::string result;
        for (const auto& w : writes) {
            std::uint32_t value = 0;
            std::memcpy(&value, w.data.data(), w.data.size());
            char line[80];
            std::snprintf(line, sizeof line, "%04x:%u=%x%s ", w.index, unsigned{w.sub}, value,
                          w.optional ? "?" : "");
            result += line;
        }
        return result;
    };
    EXPECT_EQ(text(tpdo_writes(2, {.event_ms = 10, .mapping = {map_entry(0x6041, 0, 16)}}, 5)),
              "1801:1=80000285 1a01:0=0 1a01:1=60410010 1a01:0=1 1801:2=ff 1801:3=0? 1801:5=a "
              "1801:6=0? 1801:1=285 ");
    EXPECT_EQ(
        text(rpdo_writes(
            3, {.cob = 0x400, .plus_node_id = true, .mapping = {map_entry(0x6040, 0, 16)}}, 5)),
        "1402:1=80000405 1602:0=0 1602:1=60400010 1602:0=1 1402:2=ff 1402:3=0? 1402:5=0? "
        "1402:1=405 ");
    EXPECT_EQ(text(tpdo_writes(5, {.mapping = {map_entry(0x6041, 0, 16)}}, 5)),
              "1804:1=80000000 1a04:0=0 1a04:1=60410010 1a04:0=1 1804:2=ff 1804:3=0? 1804:5=0? "
              "1804:6=0? ");
    EXPECT_EQ(text(rpdo_writes(1, {}, 5)), "1400:1=80000205 ");
    EXPECT_EQ(rpdo_writes(1, {}, 5)[0].name, "RPDO1 COB-ID");
    const std::array<std::uint8_t, 4> off{0, 0, 0, 0x80}, other_off{1, 2, 0, 0x80}, on{5, 2, 0, 0},
        no_rtr{5, 2, 0, 0x40};
    EXPECT_TRUE(same_value(0x1400, 1, off, other_off));
    EXPECT_FALSE(same_value(0x1400, 1, off, on));
    EXPECT_FALSE(same_value(0x1400, 1, on, off));
    EXPECT_TRUE(same_value(0x1800, 1, on, no_rtr));
    EXPECT_FALSE(same_value(0x2000, 1, on, no_rtr));
    EXPECT_FALSE(same_value(0x2000, 1, on, std::span(on).first(2)));
}

TEST(Configure, Writes_write_only_objects_without_reading_them) {
    Configured b([](NodeSetup& n) {
        n.writes = {object_write(0x2003, 0, std::uint8_t{3}),
                    object_write(0x2000, 0, std::uint32_t{5})};
    });
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

TEST(Configure, Skips_optional_objects_that_are_missing) {
    Configured b([](NodeSetup& n) {
        n.writes = {object_write(0x5000, 0, std::uint8_t{0})};
        n.writes[0].optional = true;
    });
    b.start();
    EXPECT_TRUE(b.operational());
    EXPECT_EQ(b.writes(0x5000), 0U);
}

TEST(Configure, Takes_a_self_started_node_out_of_operational) {
    Configured b(two_objects, example(), true);
    Spoil refuses;
    refuses.write = [&](Entry&, std::span<const std::uint8_t>) {
        return b.station.device.state() == NmtState::operational ? Abort::device_state
                                                                 : Abort::none;
    };
    b.station.device.dictionary().handle(0x2000, refuses);
    b.start();
    ASSERT_TRUE(b.operational());
    EXPECT_EQ(b.value(0, 0x2000, 0), 9U);
    EXPECT_EQ(b.status(5).attempts, 1U);
}

TEST(Configure, Continues_when_the_node_leaves_pre_operational) {
    auto d = example();
    d.find(0x1017, 0)->value = {50, 0};
    Configured b(two_objects, d);
    Spoil refuses;
    int refused = 0;
    refuses.write = [&](Entry&, std::span<const std::uint8_t>) {
        if (refused++ == 0) {
            b.station.device.command(NmtCommand::start, b.now);
            b.station.poll(b.now);
        }
        return b.station.device.state() == NmtState::operational ? Abort::device_state
                                                                 : Abort::none;
    };
    b.station.device.dictionary().handle(0x2001, refuses);
    b.start();
    ASSERT_TRUE(b.operational());
    EXPECT_EQ(b.value(0, 0x2000, 0), 9U);
    EXPECT_GE(refused, 2);
}

TEST(Configure, Is_skipped_when_date_and_time_match) {
    auto d = example();
    using enum Access;
    d.add(0x1020, 0, Type::unsigned8, constant, 2);
    d.add(0x1020, 1, Type::unsigned32, read_write);
    d.add(0x1020, 2, Type::unsigned32, read_write);
    const auto dated = [](NodeSetup& n) {
        two_objects(n);
        n.configuration_date = 14000;
        n.configuration_time = 5000;
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

TEST(Configure, Waits_for_a_slow_node_up_to_its_SDO_timeout) {
    const auto boots = [](Time own, int resends) {
        Configured b([&](NodeSetup& n) {
            n.sdo_timeout = own;
            n.sdo_resends = resends;
            n.heartbeat_limit = -1;
        });
        b.station.delay = 700 * millisecond;  // longer than the master's own SDO timeout
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
    b.station.device.dictionary().keep(0x2000, 0x2fff, false);  // changed by another program
    b.start();
    ASSERT_TRUE(b.operational());
    EXPECT_EQ(b.value(0, 0x2000, 0), 0x12345678U);
    EXPECT_EQ(b.station.restored, 1);
    EXPECT_EQ(b.station.stored, 1);
    EXPECT_EQ(b.way(5),
              "queued, resetting, identifying, configuring, restoring its defaults, resetting, "
              "identifying, configuring, saving, "
              "waiting for its heartbeat, ready, starting, running");
    EXPECT_EQ(b.station.resets, (std::vector{false, true}));
}

TEST(Configure, Writes_long_values) {
    Configured b([](NodeSetup& n) {
        ObjectWrite text{{0x2005, 0, {}}};

        ObjectWrite domain{{0x2006, 0, std::vector<std::uint8_t>(5000, 0x5a)}};
        for (const char c : std::string("a name of more than one segment")) {
            text.data.push_back(static_cast<std::uint8_t>(c));
        }
        n.writes = {text, domain};
    });
    b.start();
    ASSERT_TRUE(b.operational());
    EXPECT_EQ(b.station.device.dictionary().find(0x2005, 0)->size, 31U);
    EXPECT_EQ(b.station.device.dictionary().find(0x2006, 0)->size, 5000U);
    EXPECT_EQ(b.status(5).written, 3U);
}

TEST(Configure, Accepts_a_concise_DCF) {
    const std::vector<eds::Write> writes{{0x2000, 0, {1, 0, 0, 0}}, {0x2001, 0, {2, 0}}};
    const auto parsed = eds::parse_concise(eds::concise(writes));
    ASSERT_TRUE(parsed);
    Configured b([&](NodeSetup& n) { n.writes = object_writes(*parsed); });
    b.start();
    ASSERT_TRUE(b.operational());
    EXPECT_EQ(b.value(0, 0x2000, 0), 1U);
}

}  // namespace
}  // namespace hal::canopen::test
