// SPDX-License-Identifier: MIT
#include "canopen/device/drive/axis_io.hpp"
#include "device_bench.hpp"

namespace hal::canopen::test {
namespace {

/// A plant whose inputs the test sets.
struct Terminals final : Plant {
    double duty = 0.0;
    bool on = false;
    bool closed = true;
    std::int64_t counted = 0;
    std::int64_t second = 0;
    void step(double d, bool o, Time) noexcept override {
        duty = d;
        on = o;
    }
    std::int64_t count() const noexcept override { return counted; }
    std::int64_t second_count() const noexcept override { return second; }
    bool input() const noexcept override { return closed; }
    double current() const noexcept override { return 1.5; }
    double position() const noexcept override { return 0.0; }
    double second_position() const noexcept override { return 0.0; }
    std::span<const Influence> influences() const noexcept override { return {}; }
    void put(std::size_t, double) noexcept override {}
};

struct AxisIoDevice : testing::Test {
    AxisIoDevice() : program(AxisIoSettings{}, std::make_unique<Terminals>()), bench(program) {
        bench.start();
        EXPECT_EQ(bench.write<std::uint32_t>(0x1006, 0, 1000), Abort::none);  // us between SYNCs
    }
    Terminals& plant() { return static_cast<Terminals&>(program.plant()); }
    /// Controlword, set-point and outputs, then the SYNC of the cycle.
    void cycle(std::uint16_t controlword, std::int16_t set_point, std::uint8_t outputs = 0) {
        const auto low = [](unsigned v) { return static_cast<std::uint8_t>(v & 0xff); };
        const auto s = static_cast<std::uint16_t>(set_point);
        bench.send(Frame(
            0x205, {low(controlword), low(controlword >> 8U), low(s), low(s >> 8U), outputs}));
        bench.send(Frame(0x80, {}));
        bench.run(millisecond);
    }
    void switch_on() {
        for (const std::uint16_t word :
             std::initializer_list<std::uint16_t>{0x06, 0x07, 0x0f, 0x0f}) {
            cycle(word, 0);
        }
        ASSERT_EQ(program.state(), AxisIo::State::on);
    }
    AxisIo program;
    Bench bench;
};

TEST_F(AxisIoDevice, goes_from_stopped_to_ready_to_on_and_back) {
    EXPECT_EQ(program.state(), AxisIo::State::stopped);
    cycle(0x0f, 1000);
    EXPECT_EQ(program.state(), AxisIo::State::stopped) << "not at once";
    cycle(0x06, 1000);
    EXPECT_EQ(program.state(), AxisIo::State::ready);
    cycle(0x07, 1000);
    EXPECT_FALSE(plant().on);
    cycle(0x0f, 16384);
    EXPECT_EQ(program.state(), AxisIo::State::on);
    bench.run(millisecond);
    EXPECT_TRUE(plant().on);
    EXPECT_NEAR(plant().duty, 0.5, 1e-4);
    cycle(0x0f, -32768);
    bench.run(millisecond);
    EXPECT_EQ(plant().duty, -1.0);
    cycle(0x00, 16384);
    bench.run(millisecond);
    EXPECT_EQ(program.state(), AxisIo::State::stopped);
    EXPECT_FALSE(plant().on);
    EXPECT_EQ(plant().duty, 0.0);
}

TEST_F(AxisIoDevice, samples_both_counters_with_the_sync_sixteen_bits_of_each) {
    plant().counted = 70000;
    plant().second = -3;
    bench.forget();
    bench.sync();
    const auto answers = bench.sent(0x185);
    ASSERT_EQ(answers.size(), 1U);
    EXPECT_EQ(answers[0].length, 7);
    EXPECT_EQ(load<std::int16_t>(answers[0].data.data() + 2),
              static_cast<std::int16_t>(70000 - 65536));
    EXPECT_EQ(load<std::int16_t>(answers[0].data.data() + 4), -3);
    EXPECT_EQ(answers[0].data[6], 1);
}

TEST_F(AxisIoDevice, turns_the_motor_off_when_no_sync_or_no_set_point_comes_for_three_periods) {
    switch_on();
    for (int n = 0; n < 5; ++n) {
        bench.send(Frame(0x80, {}));
        bench.run(millisecond);
    }
    EXPECT_EQ(program.state(), AxisIo::State::fault);
    EXPECT_EQ(program.error_code(), 0x8700);
    EXPECT_FALSE(bench.sent(0x085).empty());
    cycle(0x80, 0);
    EXPECT_EQ(program.state(), AxisIo::State::stopped);
    switch_on();
    cycle(0x0f, 100);
    bench.run(6 * millisecond);
    EXPECT_EQ(program.state(), AxisIo::State::fault);
}

TEST_F(AxisIoDevice, is_in_fault_while_its_encoder_is_broken_or_an_input_that_stops_is_open) {
    switch_on();
    program.break_encoder(true);
    bench.run(millisecond);
    EXPECT_EQ(program.error_code(), 0x7305);
    cycle(0x80, 0);
    EXPECT_EQ(program.state(), AxisIo::State::fault) << "it is still broken";
    program.break_encoder(false);
    cycle(0x00, 0);
    cycle(0x80, 0);
    EXPECT_EQ(program.state(), AxisIo::State::stopped);
    ASSERT_EQ(bench.write<std::uint8_t>(0x2111, 0, 1), Abort::none);
    switch_on();
    plant().closed = false;
    bench.run(millisecond);
    EXPECT_EQ(program.error_code(), 0x9000);
    EXPECT_EQ(program.duty(), 0.0);
}

TEST_F(AxisIoDevice, stops_when_it_leaves_the_operational_state) {
    switch_on();
    cycle(0x0f, 1000, 0x1f);
    EXPECT_EQ(program.outputs(), 0x0f);
    bench.command(NmtCommand::enter_pre_operational);
    EXPECT_EQ(program.state(), AxisIo::State::stopped);
    EXPECT_EQ(program.outputs(), 0);
    EXPECT_EQ(program.duty(), 0.0);
}

TEST(Plants,
     a_slide_moves_where_the_motor_drives_it_and_the_second_encoder_follows_within_its_backlash) {
    auto plant = make_plant("axis");
    for (int n = 0; n < 500; ++n) {
        plant->step(0.2, true, millisecond);
    }
    EXPECT_GT(plant->count(), 1000);
    EXPECT_LE(std::abs(plant->count() - plant->second_count()), 1);
    for (int n = 0; n < 2000; ++n) {
        plant->step(0.2, false, millisecond);
    }
    EXPECT_EQ(plant->current(), 0.0);
    const auto at = plant->count();
    plant->step(0.2, false, 500 * millisecond);
    EXPECT_EQ(plant->count(), at) << "friction has stopped it";
    EXPECT_EQ(make_plant("robot"), nullptr);
}

}  // namespace
}  // namespace hal::canopen::test
