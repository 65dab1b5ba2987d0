// SPDX-License-Identifier: MIT
// PDOs of one device: every transmission type, timers, mapping to the bit, re-mapping, supervision,
// many of them.
#include <gtest/gtest.h>

#include "bus.hpp"

namespace hal::canopen::test {
namespace {

struct Pdo : testing::Test {
    Recorder events;
    Bus bus;
    std::unique_ptr<Device> device;
    Time now = 0;

    void make(const Description& d) {
        device = std::make_unique<Device>(
            d, DeviceSettings{.node_id = 5, .pdo = {.send_at_start = false}}, events);
        bus.attach(*device);
        device->start(now);
        device->command(NmtCommand::start, now);
        run(0);
        bus.log.clear();
    }
    void run(Time ms) {
        for (Time n = 0; n <= ms; ++n) {
            if (n != 0) {
                now += millisecond;
            }
            device->poll(now);
            bus.exchange(now);
        }
    }
    void send(const Frame& f) {
        bus.inject(f, now);
        device->poll(now);
        bus.exchange(now);
    }
    void sync(int counter = -1) {
        now += millisecond;
        if (counter < 0) {
            send({0x80, {}});
        } else {
            send({0x80, {static_cast<std::uint8_t>(counter)}});
        }
    }
    std::size_t count(std::uint32_t id) {
        std::size_t n = 0;
        for (const auto& f : bus.sent(id)) {
            n += f.remote ? 0 : 1;
        }
        return n;
    }
    Abort write(std::uint16_t index, std::uint8_t sub, std::uint32_t value) {
        std::uint8_t bytes[4];
        store(bytes, value);
        const auto* e = device->dictionary().find(index, sub);
        return device->dictionary().write(index, sub, {bytes, e != nullptr ? e->size : 1});
    }
    template <class T>
    T get(std::uint16_t index, std::uint8_t sub = 0) {
        return device->dictionary().get<T>(index, sub);
    }
    static Description with_tpdo(std::uint8_t transmission, std::uint16_t inhibit = 0,
                                 std::uint16_t event = 0, std::uint8_t start = 0) {
        Description d = basic_device({.vendor = 1});
        d.add(0x2000, 0, Type::unsigned16, Access::read_write, 0x1234).mappable();
        add_tpdo(d, 1,
                 {.transmission = transmission,
                  .inhibit_100us = inhibit,
                  .event_ms = event,
                  .sync_start = start,
                  .mapping = {map_entry(0x2000, 0, 16)}});
        return d;
    }
};

TEST_F(Pdo, Type_0_is_sent_at_the_sync_after_an_event) {
    make(with_tpdo(0));
    sync();
    EXPECT_EQ(count(0x185), 0U);
    device->pdos().trigger(1);
    run(5);
    EXPECT_EQ(count(0x185), 0U);
    sync();
    sync();
    EXPECT_EQ(count(0x185), 1U);
}
TEST_F(Pdo, Types_1_to_240_are_sent_every_nth_sync) {
    for (const unsigned n : {1U, 2U, 3U, 240U}) {
        bus = {};
        make(with_tpdo(static_cast<std::uint8_t>(n)));
        for (unsigned s = 0; s < 480; ++s) {
            sync();
        }
        EXPECT_EQ(count(0x185), 480 / n) << n;
    }
}
TEST_F(Pdo, Sync_start_value_waits_for_its_counter) {
    auto d = with_tpdo(2, 0, 0, 3);
    *d.find(0x1019, 0)->value.data() = 4;
    make(d);
    for (int n = 0; n < 2; ++n) {
        sync(n + 1);
    }
    EXPECT_EQ(count(0x185), 0U);
    sync(3);
    EXPECT_EQ(count(0x185), 1U);
    sync(4);
    EXPECT_EQ(count(0x185), 1U);
    sync(1);
    EXPECT_EQ(count(0x185), 2U);
}
TEST_F(Pdo, Type_252_answers_a_remote_frame_with_the_value_of_the_last_sync) {
    make(with_tpdo(252));
    send(Frame::request(0x185, 2));
    EXPECT_EQ(count(0x185), 0U);
    sync();
    device->dictionary().set<std::uint16_t>(0x2000, 0, 7);
    send(Frame::request(0x185, 2));
    ASSERT_EQ(count(0x185), 1U);
    EXPECT_EQ(load<std::uint16_t>(bus.log.back().data.data()), 0x1234);
}
TEST_F(Pdo, Type_253_samples_when_asked_unless_bit_30_forbids) {
    make(with_tpdo(253));
    device->dictionary().set<std::uint16_t>(0x2000, 0, 7);
    send(Frame::request(0x185, 2));
    ASSERT_EQ(count(0x185), 1U);
    EXPECT_EQ(load<std::uint16_t>(bus.log.back().data.data()), 7);
    EXPECT_EQ(write(0x1800, 1, 0x80000185), Abort::none);
    EXPECT_EQ(write(0x1800, 1, 0x40000185), Abort::none);
    send(Frame::request(0x185, 2));
    EXPECT_EQ(count(0x185), 1U);
}
TEST_F(Pdo, Event_timer_of_a_cycle_is_over_in_every_cycle_though_cycles_are_moved) {
    for (const std::uint16_t inhibit : {std::uint16_t{0}, std::uint16_t{10}}) {
        bus = {};
        make(with_tpdo(254, inhibit, 1));
        // an external clock reference moves them by some microseconds
        for (int n = 0; n < 400; ++n) {
            now += millisecond + (n * 7919 % 13 - 6) * microsecond;
            device->poll(now);
            bus.exchange(now);
        }
        EXPECT_EQ(count(0x185), 400U) << inhibit;
    }
    bus = {};
    make(with_tpdo(254, 0, 4));
    for (int n = 0; n < 400; ++n) {
        now += millisecond + (n % 2 == 0 ? 3 : -3) * microsecond;
        device->poll(now);
        bus.exchange(now);
    }
    EXPECT_EQ(count(0x185), 100U) << "longer ones end with the cycle next to them";
}
TEST_F(Pdo, Types_254_and_255_follow_events_within_the_inhibit_time) {
    for (const std::uint8_t type : {std::uint8_t{254}, std::uint8_t{255}}) {
        bus = {};
        make(with_tpdo(type, 100));  // 10 ms
        for (int n = 0; n < 100; ++n) {
            device->pdos().trigger(1);
            run(1);
        }
        EXPECT_NEAR(static_cast<double>(count(0x185)), 10, 1);
        device->dictionary().set<std::uint16_t>(0x2000, 0, 99);
        device->pdos().trigger(*device->dictionary().find(0x2000, 0));
        run(11);
        EXPECT_EQ(load<std::uint16_t>(bus.log.back().data.data()), 99);
    }
}
TEST_F(Pdo, Event_timer_sends_when_nothing_else_did) {
    make(with_tpdo(255, 0, 20));
    run(200);
    EXPECT_EQ(count(0x185), 10U);
}
TEST_F(Pdo, Change_of_a_value_is_an_event_when_wanted) {
    make(with_tpdo(255));
    device->pdos().send_on_change(1);
    run(1);
    const auto before = count(0x185);
    device->dictionary().set<std::uint16_t>(0x2000, 0, 1);
    run(5);
    EXPECT_EQ(count(0x185), before + 1);
}
TEST_F(Pdo, Becomes_operational_with_one_of_each_event_driven_pdo) {
    device = std::make_unique<Device>(with_tpdo(255), DeviceSettings{.node_id = 5}, events);
    bus.attach(*device);
    device->start(0);
    run(1);
    EXPECT_EQ(count(0x185), 0U);
    device->command(NmtCommand::start, now);
    run(5);
    EXPECT_EQ(count(0x185), 1U);
    device->command(NmtCommand::enter_pre_operational, now);
    device->pdos().trigger(1);
    run(5);
    EXPECT_EQ(count(0x185), 1U);
}

TEST_F(Pdo, Received_at_once_or_at_the_next_sync) {
    make(example());
    send({0x205, {1, 0, 0, 0, 0xfe, 0xff}});
    EXPECT_EQ(get<std::uint32_t>(0x2000), 1U);
    EXPECT_EQ(get<std::int16_t>(0x2001), -2);
    send({0x305, {8, 9}});
    EXPECT_EQ(get<std::uint8_t>(0x2008, 1), 1);
    sync();
    EXPECT_EQ(get<std::uint8_t>(0x2008, 1), 8);
    EXPECT_EQ(get<std::uint8_t>(0x2008, 2), 9);
    EXPECT_EQ(events.rpdos, (std::vector<unsigned>{1, 2}));
}
TEST_F(Pdo, Too_short_is_not_processed_too_long_is) {
    make(example());
    send({0x205, {1, 0, 0, 0, 0}});
    EXPECT_EQ(get<std::uint32_t>(0x2000), 0x12345678U);
    EXPECT_TRUE(device->emcy().active(0x8210));
    send({0x205, {1, 0, 0, 0, 2, 0, 3}});
    EXPECT_EQ(get<std::uint32_t>(0x2000), 1U);
    EXPECT_TRUE(device->emcy().active(0x8220));
    send({0x205, {2, 0, 0, 0, 2, 0}});
    EXPECT_EQ(device->emcy().error_register(), 0);
    EXPECT_EQ(device->pdos().rpdo(1).errors, 1U);
    send(Frame::request(0x205, 6));
    EXPECT_EQ(device->pdos().rpdo(1).count, 2U);
}
TEST_F(Pdo, Deadline_of_a_received_one_is_watched_from_the_first_on) {
    make(example());
    EXPECT_EQ(write(0x1400, 5, 20), Abort::none);
    run(100);
    EXPECT_TRUE(events.late.empty());
    send({0x205, {1, 0, 0, 0, 0, 0}});
    run(50);
    EXPECT_EQ(events.late, (std::vector<unsigned>{1}));
    EXPECT_TRUE(device->emcy().active(0x8250));
    send({0x205, {1, 0, 0, 0, 0, 0}});
    EXPECT_FALSE(device->emcy().active(0x8250));
}
TEST_F(Pdo, Window_drops_what_comes_too_late_for_its_sync) {
    make(example());
    write(0x1007, 0, 2000);
    sync();
    now += millisecond;
    send({0x305, {8, 9}});
    now += 5 * millisecond;
    send({0x305, {1, 1}});
    sync();
    EXPECT_EQ(get<std::uint8_t>(0x2008, 1), 8);
    EXPECT_EQ(device->pdos().rpdo(2).errors, 1U);
}

TEST_F(Pdo, Is_mapped_anew_in_the_order_of_the_standard_only) {
    make(example());
    EXPECT_EQ(write(0x1600, 0, 0), Abort::access);
    EXPECT_EQ(write(0x1400, 1, 0x206), Abort::value);
    EXPECT_EQ(write(0x1400, 1, 0x80000205), Abort::none);
    EXPECT_EQ(write(0x1600, 1, map_entry(0x2008, 4, 8)), Abort::access);
    EXPECT_EQ(write(0x1600, 0, 0), Abort::none);
    EXPECT_EQ(write(0x1600, 1, map_entry(0x200a, 0, 16)), Abort::not_mappable);
    EXPECT_EQ(write(0x1600, 1, map_entry(0x2fff, 0, 16)), Abort::no_object);
    EXPECT_EQ(write(0x1600, 1, map_entry(0x2008, 4, 16)), Abort::pdo_length);
    EXPECT_EQ(write(0x1600, 1, map_entry(0x2004, 0, 64)), Abort::none);
    EXPECT_EQ(write(0x1600, 2, map_entry(0x2007, 0, 1)), Abort::none);
    EXPECT_EQ(write(0x1600, 0, 2), Abort::pdo_length);
    EXPECT_EQ(write(0x1600, 0, 9), Abort::pdo_length);
    EXPECT_EQ(write(0x1600, 0, 1), Abort::none);
    EXPECT_EQ(write(0x1400, 1, 0x701), Abort::value);
    EXPECT_EQ(write(0x1400, 2, 245), Abort::value);
    EXPECT_EQ(write(0x1400, 1, 0x345), Abort::none);
    send({0x345, {1, 2, 3, 4, 5, 6, 7, 8}});
    EXPECT_EQ(get<std::uint64_t>(0x2004), 0x0807060504030201U);
    EXPECT_EQ(device->pdos().rpdo(1).count, 1U);
    send({0x205, {1, 0, 0, 0, 0, 0}});
    EXPECT_EQ(device->pdos().rpdo(1).count, 1U);
}
TEST_F(Pdo, Carries_single_bits_parts_and_dummies) {
    Description d = basic_device({.vendor = 1});
    for (std::uint8_t n = 1; n <= 3; ++n) {
        d.add(0x2100, n, Type::boolean, Access::read_write).mappable();
    }
    d.add(0x2101, 0, Type::integer8, Access::read_write).mappable();
    d.add(0x2102, 0, Type::integer24, Access::read_write).mappable();
    const std::vector<std::uint32_t> there = {map_entry(0x2100, 1, 1), map_entry(0x0001, 0, 1),
                                              map_entry(0x2100, 2, 1), map_entry(0x2101, 0, 4),
                                              map_entry(0x2100, 3, 1), map_entry(0x0005, 0, 8),
                                              map_entry(0x2102, 0, 24)};
    const std::vector<std::uint32_t> back = {map_entry(0x2100, 1, 1), map_entry(0x2100, 2, 1),
                                             map_entry(0x2101, 0, 8), map_entry(0x2102, 0, 24)};
    add_rpdo(d, 1, {.mapping = there});
    add_tpdo(d, 1, {.mapping = back});
    make(d);
    EXPECT_EQ(device->pdos().rpdo(1).bytes, 5);
    send({0x205, {0b1'1101'1'1'1, 0xaa, 0x01, 0x00, 0x80}});
    EXPECT_EQ(get<std::uint8_t>(0x2100, 1), 1);
    EXPECT_EQ(get<std::uint8_t>(0x2100, 2), 1);
    EXPECT_EQ(get<std::int8_t>(0x2101), -3);
    EXPECT_EQ(get<std::uint8_t>(0x2100, 3), 1);
    EXPECT_EQ(get<std::uint32_t>(0x2102), 0x800001U);
    device->pdos().trigger(1);
    run(1);
    ASSERT_EQ(count(0x185), 1U);
    EXPECT_EQ(bus.log.back().length, 5);
    EXPECT_EQ(load<std::uint64_t>(bus.log.back().data.data()),
              (0x800001ULL << 10 | 0xfdULL << 2 | 3));
}
TEST_F(Pdo, Callbacks_see_all_values_of_the_frame) {
    struct Watch : Handler {
        Dictionary* dictionary = nullptr;
        std::int16_t seen = 0;
        void written(Entry&) noexcept override { seen = dictionary->get<std::int16_t>(0x2001, 0); }
    } watch;
    make(example());
    watch.dictionary = &device->dictionary();
    device->dictionary().handle(0x2000, watch);
    send({0x205, {1, 0, 0, 0, 42, 0}});
    EXPECT_EQ(watch.seen, 42);
}
TEST_F(Pdo, Multiplexed_ones_reach_the_addressed_object) {
    auto d = example();
    *d.find(0x1600, 0)->value.data() = 0xff;
    make(d);
    send({0x205, {0x85, 0x00, 0x20, 0, 9, 0, 0, 0}});
    EXPECT_EQ(get<std::uint32_t>(0x2000), 9U);
    send({0x205, {0x86, 0x00, 0x20, 0, 8, 0, 0, 0}});
    EXPECT_EQ(get<std::uint32_t>(0x2000), 9U);
    send({0x205, {0x80, 0x99, 0x20, 0, 8, 0, 0, 0}});
    EXPECT_TRUE(device->emcy().active(0x8230));
}
TEST_F(Pdo, Remote_frame_asks_the_producer) {
    make(example());
    EXPECT_TRUE(device->pdos().request(1));
    run(0);
    ASSERT_FALSE(bus.log.empty());
    EXPECT_TRUE(bus.log.back().remote);
    EXPECT_EQ(bus.log.back().id, 0x205U);
    EXPECT_EQ(bus.log.back().length, 6);
}
TEST_F(Pdo, There_can_be_512_each_way) {
    Description d = basic_device({.vendor = 1});
    for (unsigned n = 0; n < 512; ++n) {
        d.add(static_cast<std::uint16_t>(0x3000 + n), 0, Type::unsigned16, Access::read_write, n)
            .mappable();
        const auto entry = map_entry(static_cast<std::uint16_t>(0x3000 + n), 0, 16);
        add_rpdo(d, n + 1,
                 {.cob = n % 2 != 0 ? 0x20010000U + n : 0x181U + n % 0x7f,
                  .transmission = 1,
                  .mapping = {entry},
                  .max_mapped = 1});
        add_tpdo(d, n + 1,
                 {.cob = 0x20000000U + n, .transmission = 1, .mapping = {entry}, .max_mapped = 1});
    }
    make(d);
    for (unsigned n = 0; n < 512; ++n) {
        Frame f(n % 2 != 0 ? 0x10000U + n : 0x181U + n % 0x7f, {1, 1});
        f.extended = n % 2 != 0;
        send(f);
    }
    bus.log.clear();
    sync();
    std::size_t sent = 0;
    for (const auto& f : bus.log) {
        sent += f.extended && f.id < 0x10000 ? 1 : 0;
    }
    EXPECT_EQ(sent, 512U);
    EXPECT_EQ(get<std::uint16_t>(0x3000 + 511), 0x0101);
    EXPECT_EQ(get<std::uint16_t>(0x3000 + 256), 0x0101);
}
TEST_F(Pdo, Full_queue_loses_no_event) {
    device = std::make_unique<Device>(
        with_tpdo(255), DeviceSettings{.node_id = 5, .queue = 8, .pdo = {.send_at_start = false}},
        events);
    bus.attach(*device);
    device->start(0);
    device->command(NmtCommand::start, 0);
    while (device->out().space() != 0) {
        device->out().push({0x1, {}});
    }
    device->pdos().trigger(1);
    device->poll(now);
    bus.exchange(now);
    EXPECT_EQ(count(0x185), 0U);
    run(1);
    EXPECT_EQ(count(0x185), 1U);
}

}  // namespace
}  // namespace hal::canopen::test
