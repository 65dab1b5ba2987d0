// SPDX-License-Identifier: MIT
#include <cmath>

#include "canopen/device/io/io.hpp"
#include "device_bench.hpp"

namespace hal::canopen::test {
namespace {

struct IoDevice : testing::Test {
    Io io{IoSettings{}};
    Bench bench{io};
    void SetUp() override { bench.start(); }
};

TEST_F(IoDevice, shows_its_inputs_in_all_widths) {
    for (const unsigned n : {0U, 9U, 17U, 63U}) {
        io.set_input(n, true);
    }
    bench.run(2 * millisecond);
    EXPECT_EQ(bench.read<std::uint8_t>(0x6000, 1), 0x01);
    EXPECT_EQ(bench.read<std::uint8_t>(0x6000, 8), 0x80);
    EXPECT_EQ(bench.read<std::uint16_t>(0x6100, 1), 0x0201);
    EXPECT_EQ(bench.read<std::uint32_t>(0x6120, 1), 0x00020201U);
    EXPECT_EQ(bench.read<std::uint8_t>(0x6020, 18), 1);
    EXPECT_EQ(bench.read<std::uint8_t>(0x6020, 19), 0);
    EXPECT_EQ(bench.read<std::uint32_t>(0x1000, 0), 0x000f0191U);
}

TEST_F(IoDevice, sends_its_inputs_when_a_mask_says_so) {
    bench.forget();
    io.set_input(3, true);
    bench.run(2 * millisecond);
    ASSERT_EQ(bench.sent(0x185).size(), 1U);
    EXPECT_EQ(bench.sent(0x185)[0].data[0], 0x08);
    ASSERT_EQ(bench.write<std::uint8_t>(0x6006, 1, 0), Abort::none);     // no more at any change
    ASSERT_EQ(bench.write<std::uint8_t>(0x6007, 1, 0x10), Abort::none);  // bit 4 when it rises
    ASSERT_EQ(bench.write<std::uint8_t>(0x6008, 1, 0x20), Abort::none);  // bit 5 when it falls
    const auto sent_at = [&](unsigned n, bool on) {
        bench.forget();
        io.set_input(n, on);
        bench.run(2 * millisecond);
        return bench.sent(0x185).size();
    };
    EXPECT_EQ(sent_at(4, true), 1U);
    EXPECT_EQ(sent_at(4, false), 0U);
    EXPECT_EQ(sent_at(5, true), 0U);
    EXPECT_EQ(sent_at(5, false), 1U);
    EXPECT_EQ(sent_at(6, true), 0U);
    ASSERT_EQ(bench.write<std::uint8_t>(0x6005, 0, 0), Abort::none);  // none at all
    EXPECT_EQ(sent_at(4, true), 0U);
}

TEST_F(IoDevice, turns_inputs_round_and_filters_them) {
    ASSERT_EQ(bench.write<std::uint8_t>(0x6002, 2, 0xff), Abort::none);
    bench.run(2 * millisecond);
    EXPECT_EQ(bench.read<std::uint8_t>(0x6000, 2), 0xff);
    ASSERT_EQ(bench.write<std::uint8_t>(0x6003, 1, 0x01), Abort::none);
    io.set_input(0, true);
    io.set_input(1, true);
    bench.run(5 * millisecond);
    EXPECT_EQ(bench.read<std::uint8_t>(0x6000, 1), 0x02);  // bit 0 waits for its 10 ms
    io.set_input(0, false);
    bench.run(5 * millisecond);
    io.set_input(0, true);
    bench.run(9 * millisecond);
    EXPECT_EQ(io.online(), true);
    EXPECT_EQ(bench.node.device().dictionary().get<std::uint8_t>(0x6000, 1), 0x02);  // it bounced
    bench.run(3 * millisecond);
    EXPECT_EQ(bench.read<std::uint8_t>(0x6000, 1), 0x03);
}

TEST_F(IoDevice, drives_outputs_from_PDO_and_from_every_object) {
    bench.send(Frame(0x205, {0x81, 0, 0, 0, 0, 0, 0, 0x80}));
    bench.run(2 * millisecond);
    EXPECT_TRUE(io.output(0) && io.output(7) && io.output(63));
    EXPECT_FALSE(io.output(1));
    ASSERT_EQ(bench.write<std::uint8_t>(0x6220, 2, 1), Abort::none);
    EXPECT_TRUE(io.output(1));
    EXPECT_EQ(bench.read<std::uint8_t>(0x6200, 1), 0x83);
    ASSERT_EQ(bench.write<std::uint16_t>(0x6300, 1, 0x0100), Abort::none);
    EXPECT_TRUE(io.output(8) && !io.output(0));
    ASSERT_EQ(bench.write<std::uint8_t>(0x6202, 1, 0x0f), Abort::none);  // turned round
    EXPECT_TRUE(io.output(0) && !io.output(4));
    ASSERT_EQ(bench.write<std::uint8_t>(0x6208, 1, 0xfe), Abort::none);  // output 0 is left alone
    ASSERT_EQ(bench.write<std::uint8_t>(0x6200, 1, 0xff), Abort::none);
    EXPECT_TRUE(io.output(0) && !io.output(1) && io.output(4));
}

TEST_F(IoDevice, has_analogue_values_left_justified) {
    io.set_analog_input(0, 0.5);
    io.set_analog_input(11, -1.0);
    bench.run(2 * millisecond);
    EXPECT_EQ(bench.read<std::int16_t>(0x6401, 1), 16384);
    EXPECT_EQ(bench.read<std::int16_t>(0x6401, 12), -32767);
    EXPECT_EQ(bench.read<std::int32_t>(0x6402, 1), 16384 * 65536);
    EXPECT_EQ(bench.read<std::int8_t>(0x6400, 12), -128);
    bench.write<float>(0x642f, 1, 0.5F), bench.write<float>(0x642e, 1, 3.0F);
    EXPECT_EQ(bench.read<float>(0x6403, 1), 8195.0F);
    bench.send(Frame(0x305, {0x00, 0x40, 0, 0, 0, 0, 0x00, 0x80}));
    bench.run(2 * millisecond);
    EXPECT_NEAR(io.analog_output(0), 0.5, 1e-4);
    EXPECT_NEAR(io.analog_output(3), -1.0, 1e-4);
    EXPECT_EQ(bench.read<std::int32_t>(0x6412, 1), 0x4000 * 65536);
    bench.write<float>(0x6413, 2, 100.4F);
    EXPECT_EQ(bench.read<std::int16_t>(0x6411, 2), 100);
    bench.write<float>(0x6413, 2, NAN);
    EXPECT_EQ(bench.read<std::int16_t>(0x6411, 2), 0);
}

TEST_F(IoDevice, sends_analogue_inputs_by_limits_and_deltas) {
    const auto sent_at = [&](double fraction) {
        bench.forget();
        io.set_analog_input(0, fraction);
        bench.run(2 * millisecond);
        return bench.sent(0x285).size();
    };
    EXPECT_EQ(sent_at(0.1), 0U);  // 6423h is false until a master wants them
    ASSERT_EQ(bench.write<std::uint8_t>(0x6423, 0, 1), Abort::none);
    EXPECT_EQ(sent_at(0.2), 1U);  // by default at any change
    EXPECT_EQ(sent_at(0.2), 0U);
    ASSERT_EQ(bench.write<std::uint8_t>(0x6421, 1, 4), Abort::none);
    // a tenth of the range
    ASSERT_EQ(bench.write<std::uint32_t>(0x6426, 1, 3277U << 16), Abort::none);
    EXPECT_EQ(sent_at(0.25), 0U);
    EXPECT_EQ(sent_at(0.31), 1U);
    EXPECT_EQ(sent_at(0.20), 1U);
    // above a limit, and risen
    ASSERT_EQ(bench.write<std::uint8_t>(0x6421, 1, 1 | 16), Abort::none);
    ASSERT_EQ(bench.write<std::int32_t>(0x6424, 1, 16384 * 65536), Abort::none);
    EXPECT_EQ(sent_at(0.4), 0U);
    EXPECT_EQ(sent_at(0.6), 1U);
    EXPECT_EQ(sent_at(0.55), 0U);
    EXPECT_EQ(bench.read<std::uint32_t>(0x6422, 1), 1U);
    EXPECT_EQ(bench.read<std::uint32_t>(0x6422, 1), 0U);  // reading took it
    EXPECT_EQ(bench.write<std::uint8_t>(0x6421, 1, 32), Abort::too_high);
}

TEST_F(IoDevice, takes_its_error_values_when_the_master_falls_silent) {
    ASSERT_EQ(bench.write<std::uint32_t>(0x1016, 1, 0x00010064), Abort::none);  // node 1, 100 ms
    // 0–3 take a value, 4–7 stay
    ASSERT_EQ(bench.write<std::uint8_t>(0x6206, 1, 0x0f), Abort::none);
    ASSERT_EQ(bench.write<std::uint8_t>(0x6207, 1, 0x05), Abort::none);
    ASSERT_EQ(bench.write<std::int32_t>(0x6444, 1, -16384 * 65536), Abort::none);
    ASSERT_EQ(bench.write<std::uint8_t>(0x6443, 2, 0), Abort::none);
    bench.send(Frame(0x701, {5}));
    bench.send(Frame(0x205, {0xaa, 0xff, 0, 0, 0, 0, 0, 0}));
    bench.send(Frame(0x305, {0x00, 0x40, 0x00, 0x20, 0, 0, 0, 0}));
    bench.run(90 * millisecond);
    EXPECT_EQ(bench.read<std::uint8_t>(0x6200, 1), 0xaa);
    EXPECT_FALSE(io.safe());
    bench.run(100 * millisecond);
    EXPECT_TRUE(io.safe());
    EXPECT_EQ(bench.node.device().state(), NmtState::pre_operational);  // 1029h is 0
    EXPECT_EQ(bench.read<std::uint8_t>(0x6200, 1), 0xa5);
    EXPECT_EQ(bench.read<std::uint8_t>(0x6200, 2), 0x00);
    EXPECT_NEAR(io.analog_output(0), -0.5, 1e-4);
    EXPECT_NEAR(io.analog_output(1), 0.25, 1e-4);
    EXPECT_EQ(bench.remote().emergency(0).code, 0x8130);
    bench.send(Frame(0x701, {5}));
    bench.command(NmtCommand::start);
    EXPECT_TRUE(io.safe() && !io.output(1));  // until an RPDO writes the outputs
    bench.send(Frame(0x205, {0x02, 0, 0, 0, 0, 0, 0, 0}));
    bench.run(2 * millisecond);
    EXPECT_TRUE(!io.safe() && io.output(1));
    bench.command(NmtCommand::stop);
    EXPECT_TRUE(io.safe());
}

TEST_F(IoDevice, begins_anew_after_a_reset_with_what_was_stored) {
    ASSERT_EQ(bench.write<std::uint8_t>(0x6207, 1, 0x33), Abort::none);
    ASSERT_EQ(bench.write<std::uint8_t>(0x6200, 1, 0x01), Abort::none);
    ASSERT_EQ(bench.write<std::uint32_t>(0x1010, 3, 0x65766173), Abort::none);
    ASSERT_EQ(bench.write<std::uint8_t>(0x6207, 1, 0x44), Abort::none);
    ASSERT_EQ(bench.write<std::uint8_t>(0x6200, 1, 0x02), Abort::none);
    bench.node.power(false);
    bench.run(20 * millisecond);
    bench.forget();
    bench.node.power(true);
    bench.run(5 * millisecond);
    EXPECT_EQ(bench.sent(0x705).size(), 1U);
    EXPECT_EQ(bench.read<std::uint8_t>(0x6207, 1), 0x33);
    EXPECT_TRUE(io.output(0) && !io.output(1));
}

TEST(IoDevices, are_as_large_as_was_said) {
    Io io(IoSettings{
        .digital_inputs = 3, .digital_outputs = 0, .analog_inputs = 5, .analog_outputs = 0});
    Bench bench(io);
    bench.start();
    EXPECT_EQ(bench.read<std::uint8_t>(0x6000, 0), 1);
    EXPECT_EQ(bench.read<std::uint32_t>(0x1000, 0), 0x00050191U);
    bench.read<std::uint8_t>(0x6200, 1);
    EXPECT_EQ(bench.last_abort, Abort::no_object);
    EXPECT_EQ(bench.read<std::uint32_t>(0x1400, 1) >> 31, 1U);
    EXPECT_EQ(bench.read<std::uint8_t>(0x1a02, 0), 1);
    io.set_input(3, true);
    io.set_input(64, true);
    io.set_analog_input(5, 1.0);
    bench.run(2 * millisecond);
    EXPECT_EQ(bench.read<std::uint8_t>(0x6000, 1), 0);
    EXPECT_THROW(Io(IoSettings{.digital_inputs = 65}).description(), std::invalid_argument);
}

}  // namespace
}  // namespace hal::canopen::test
