// SPDX-License-Identifier: MIT
// Multiplexed PDOs both ways: to an object of another node (DAM), and from one of one's own to whom it concerns (SAM).
#include "node.hpp"

namespace hal::canopen::test {
namespace {

struct Mpdo : Node {
    /// PDO 1 each way multiplexed, `kind` FFh for DAM, FEh for SAM.
    void make_multiplexed(std::uint8_t kind, bool with_list = true) {
        auto d = example();
        for (const std::uint16_t mapping : std::initializer_list<std::uint16_t>{0x1600, 0x1a00}) *d.find(mapping, 0)->value.data() = kind;
        if (with_list) {
            // Object 2008h, from sub-index 1, four of them, is what node 7 has as 3000h from sub-index 5.
            d.add(0x1fd0, 0, Type::unsigned8, Access::constant, 1);
            d.add(0x1fd0, 1, Type::unsigned64, Access::read_write, 0x04'2008'01'3000'05'07);
        }
        bus = Bus{};
        make(d);
        nmt(NmtCommand::start);
        bus.log.clear();
    }
    std::uint8_t value(std::uint8_t sub) { return device->dictionary().get<std::uint8_t>(0x2008, sub); }
    Frame only(std::uint32_t id) {
        run(0);
        const auto frames = since(id);
        return frames.size() == 1 ? frames[0] : Frame{};
    }
};

TEST_F(Mpdo, Destination_and_object_go_out_with_the_value) {
    make_multiplexed(0xff);
    EXPECT_TRUE(device->pdos().send_to(1, 9, 0x6200, 2, 0xdeadbeef));
    const Frame f = only(0x185);
    const std::uint8_t wanted[] = {0x89, 0x00, 0x62, 0x02, 0xef, 0xbe, 0xad, 0xde};
    ASSERT_EQ(f.length, 8);
    EXPECT_TRUE(std::equal(std::begin(wanted), std::end(wanted), f.data.begin()));
    EXPECT_TRUE(device->pdos().send_to(1, 0, 0x6200, 2, 1));
    EXPECT_FALSE(device->pdos().send_from(1, 0x2008, 1)) << "this one says destinations";
}

TEST_F(Mpdo, Own_node_and_object_go_out_with_the_value) {
    make_multiplexed(0xfe);
    EXPECT_TRUE(device->pdos().send_from(1, 0x2001, 0));
    const Frame f = only(0x185);
    EXPECT_EQ(f.data[0], 5);
    EXPECT_EQ(load<std::uint16_t>(f.data.data() + 1), 0x2001);
    EXPECT_FALSE(device->pdos().send_from(1, 0x200a, 0)) << "cannot be mapped";
    EXPECT_FALSE(device->pdos().send_from(1, 0x5555, 0));
    EXPECT_FALSE(device->pdos().send_to(1, 9, 0x2001, 0, 1)) << "this one says sources";
}

TEST_F(Mpdo, Addressed_to_all_reaches_us_and_to_another_does_not) {
    make_multiplexed(0xff);
    send({0x205, {0x80, 0x08, 0x20, 2, 0x33, 0, 0, 0}});
    EXPECT_EQ(value(2), 0x33);
    send({0x205, {0x89, 0x08, 0x20, 2, 0x44, 0, 0, 0}});
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
    for (const auto& f : {Frame{0x205, {8, 0x00, 0x30, 5, 9, 0, 0, 0}}, Frame{0x205, {7, 0x01, 0x30, 5, 9, 0, 0, 0}},
                          Frame{0x205, {7, 0x00, 0x30, 9, 9, 0, 0, 0}}, Frame{0x205, {7, 0x00, 0x30, 4, 9, 0, 0, 0}}})
        send(f);
    for (std::uint8_t sub = 1; sub <= 4; ++sub) EXPECT_EQ(value(sub), sub);
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
