// SPDX-License-Identifier: MIT
// Multiplexed PDOs both ways: to an object of another node (DAM), and from one of one's own to whom
// it concerns (SAM).
#include "node.hpp"

namespace hal::canopen::test {
namespace {

struct Mpdo : Node {
    /// PDO 1 each way multiplexed, `kind` FFh for DAM, FEh for SAM.
    void make_multiplexed(std::uint8_t kind, bool with_list = true) {
        auto d = example();
        for (const std::uint16_t mapping : std::initializer_list<std::uint16_t>{0x1600, 0x1a00}) {
            *d.find(mapping, 0)->value.data() = kind;
        }
        if (with_list) {
            // Object 2008h, from sub-index 1, four of them, is what node 7 has as 3000h from
            // sub-index 5.
            d.add(0x1fd0, 0, Type::unsigned8, Access::constant, 1);
            d.add(0x1fd0, 1, Type::unsigned64, Access::read_write, 0x04'2008'01'3000'05'07);
        }
        bus = Bus{};
        make(d);
        nmt(NmtCommand::start);
        bus.log.clear();
    }
    std::uint8_t value(std::uint8_t sub) {
        return device->dictionary().get<std::uint8_t>(0x2008, sub);
    }
    Frame only(std::uint32_t id) {
        run(0);
        const auto frames = since(id);
        return frames.size() == 1 ? frames[0] : Frame{};
    }
};

TEST_F(Mpdo, Destination_and_object_go_out_with_the_value) {
    make_multiplexed(0xff);
    EXPECT_TRUE(device->pdos().send_dam(1, 9, 0x6200, 2, 0xdeadbeef));
    const Frame f = only(0x185);
    const std::uint8_t wanted[] = {0x89, 0x00, 0x62, 0x02, 0xef, 0xbe, 0xad, 0xde};
    ASSERT_EQ(f.length, 8);
    EXPECT_TRUE(std::equal(std::begin(wanted), std::end(wanted), f.data.begin()));
    EXPECT_TRUE(device->pdos().send_dam(1, 0, 0x6200, 2, 1));
    EXPECT_FALSE(device->pdos().send_sam(1, 0x2008, 1))
        << "TPDO 1 is in destination addressing mode";
}

TEST_F(Mpdo, Own_node_and_object_go_out_with_the_value) {
    make_multiplexed(0xfe);
    EXPECT_TRUE(device->pdos().send_sam(1, 0x2001, 0));
    const Frame f = only(0x185);
    EXPECT_EQ(f.data[0], 5);
    EXPECT_EQ(load<std::uint16_t>(f.data.data() + 1), 0x2001);
    EXPECT_FALSE(device->pdos().send_sam(1, 0x200a, 0)) << "cannot be mapped";
    EXPECT_FALSE(device->pdos().send_sam(1, 0x5555, 0));
    EXPECT_FALSE(device->pdos().send_dam(1, 9, 0x2001, 0, 1))
        << "TPDO 1 is in source addressing mode";
}

/// With a scanner list: two of the four values of 2008h, and 2001h.
struct Scanner : Mpdo {
    void make_scanner(std::uint16_t inhibit_100us = 0) {
        auto d = example();
        *d.find(0x1a00, 0)->value.data() = 0xfe;
        d.find(0x1800, 3)->value = {static_cast<std::uint8_t>(inhibit_100us),
                                    static_cast<std::uint8_t>(inhibit_100us >> 8)};
        d.add(0x1fa0, 0, Type::unsigned8, Access::constant, 3);
        d.add(0x1fa0, 1, Type::unsigned32, Access::read_write, 0x02'2008'01);
        d.add(0x1fa0, 2, Type::unsigned32, Access::read_write, 0x01'2001'00);
        d.add(0x1fa0, 3, Type::unsigned32, Access::read_write, 0);
        bus = Bus{};
        make(d);
        nmt(NmtCommand::start);
        run(0);
    }
    /// Index, sub-index and value of each multiplexed PDO since the last call.
    std::vector<std::array<unsigned, 3>> told() {
        std::vector<std::array<unsigned, 3>> all;
        for (const Frame& f : since(0x185)) {
            EXPECT_EQ(f.length, 8);
            EXPECT_EQ(f.data[0], 5);
            all.push_back({load<std::uint16_t>(f.data.data() + 1), f.data[3],
                           load<std::uint32_t>(f.data.data() + 4)});
        }
        bus.log.clear();
        return all;
    }
    using Told = std::vector<std::array<unsigned, 3>>;
};

TEST_F(Scanner, Tells_what_is_in_its_list_once_and_then_what_changes) {
    make_scanner();
    EXPECT_EQ(told(), (Told{{0x2008, 1, 1}, {0x2008, 2, 2}, {0x2001, 0, 0}}));
    run(5);
    EXPECT_EQ(told(), Told{});
    device->dictionary().set<std::uint8_t>(0x2008, 2, 0x55);
    device->dictionary().set<std::uint8_t>(0x2008, 3, 0x66);  // not in the list
    device->dictionary().set<std::int16_t>(0x2001, 0, -2);
    run(1);
    EXPECT_EQ(told(), (Told{{0x2008, 2, 0x55}, {0x2001, 0, 0xfffe}}));
    ASSERT_EQ(write(0x1fa0, 3, 0x01'2008'03, 4), Abort::none);
    bus.log.clear();
    run(1);
    EXPECT_EQ(told(),
              (Told{{0x2008, 1, 1}, {0x2008, 2, 0x55}, {0x2001, 0, 0xfffe}, {0x2008, 3, 0x66}}))
        << "a new scanner list sends all its objects";
    nmt(NmtCommand::enter_pre_operational);
    device->dictionary().set<std::uint8_t>(0x2008, 1, 9);
    run(1);
    EXPECT_EQ(told(), Told{});
}

TEST_F(Scanner, Keeps_its_inhibit_time_and_lets_none_wait_for_ever) {
    make_scanner(50);  // 5 ms
    told();
    Told all;
    std::uint8_t beat = 10;
    for (int n = 0; n < 40; ++n) {
        device->dictionary().set<std::uint8_t>(0x2008, 1, ++beat);
        device->dictionary().set<std::uint8_t>(0x2008, 2, ++beat);
        device->dictionary().set<std::int16_t>(0x2001, 0, static_cast<std::int16_t>(n));
        run(1);
        const auto more = told();
        all.insert(all.end(), more.begin(), more.end());
    }
    EXPECT_NEAR(static_cast<double>(all.size()), 8, 1);
    std::array<int, 3> each{};
    for (const auto& t : all) {
        ++each[t[0] == 0x2001 ? 2 : t[1] - 1];
    }
    for (const int n : each) {
        EXPECT_GE(n, 2);
    }
}

TEST_F(Mpdo, Addressed_to_all_reaches_us_and_to_another_does_not) {
    make_multiplexed(0xff);
    send({0x205, {0x80, 0x08, 0x20, 2, 0x33, 0, 0, 0}});
    EXPECT_EQ(value(2), 0x33);
    send({0x205, {0x89, 0x08, 0x20, 2, 0x44, 0, 0, 0}});
    EXPECT_EQ(value(2), 0x33);
}

TEST_F(Mpdo, Destination_that_is_not_there_is_an_error_until_one_is) {
    make_multiplexed(0xff);
    send({0x205, {0x85, 0x55, 0x55, 1, 1, 0, 0, 0}});
    EXPECT_TRUE(device->emcy().active(0x8230));
    EXPECT_EQ(device->pdos().rpdo(1).errors, 1U);
    send({0x205, {0x85, 0x08, 0x20, 2, 0x33, 0, 0, 0}});
    EXPECT_FALSE(device->emcy().active(0x8230));
    EXPECT_EQ(value(2), 0x33);
}

TEST_F(Mpdo, Source_in_the_dispatcher_list_is_written_to_its_object_here) {
    make_multiplexed(0xfe);
    send({0x205, {7, 0x00, 0x30, 5, 0x51, 0, 0, 0}});
    send({0x205, {7, 0x00, 0x30, 8, 0x54, 0, 0, 0}});
    EXPECT_EQ(value(1), 0x51);
    EXPECT_EQ(value(4), 0x54);
    EXPECT_EQ(device->pdos().rpdo(1).count, 2U);
}

TEST_F(Mpdo, Source_that_is_not_in_the_list_is_of_no_concern) {
    make_multiplexed(0xfe);
    for (const auto& f : {Frame{0x205, {8, 0x00, 0x30, 5, 9, 0, 0, 0}},
                          Frame{0x205, {7, 0x01, 0x30, 5, 9, 0, 0, 0}},
                          Frame{0x205, {7, 0x00, 0x30, 9, 9, 0, 0, 0}},
                          Frame{0x205, {7, 0x00, 0x30, 4, 9, 0, 0, 0}}}) {
        send(f);
    }
    for (std::uint8_t sub = 1; sub <= 4; ++sub) {
        EXPECT_EQ(value(sub), sub);
    }
    EXPECT_EQ(device->pdos().rpdo(1).count, 0U);
    EXPECT_FALSE(device->emcy().active(0x8230));
}

TEST_F(Mpdo, Short_ones_and_those_of_the_other_kind_are_not_taken) {
    make_multiplexed(0xfe);
    send({0x205, {7, 0x00, 0x30, 5, 9, 0, 0}});
    send({0x205, {0x85, 0x08, 0x20, 1, 9, 0, 0, 0}});
    EXPECT_EQ(value(1), 1);
    EXPECT_EQ(device->pdos().rpdo(1).errors, 2U);
}

}  // namespace
}  // namespace hal::canopen::test
