// SPDX-License-Identifier: MIT
// The analogue-input block of CiA 404: scaling, views of one value in four families, zero, tare,
// deltas and limits.
#include "canopen/device/sensor/analog_input.hpp"
#include "canopen/device/sensor/jr3.hpp"
#include "device_bench.hpp"

namespace hal::canopen::test {
namespace {

/// Two channels of a transmitter, 4 to 20 mA on the first.
struct Transmitter final : Program {
    AnalogInputs inputs;
    double field[2] = {};
    std::int32_t counts = 0;
    Time stepped = 0;

    Description description() const override {
        Description d = basic_device(
            {.device_type = 0x00020194, .vendor = 1, .product = 2, .name = "transmitter"});
        const AnalogChannel channels[] = {{"Pressure", 40, 0x004e0000, 1}, {"Spare"}};
        add_analog_inputs(d, channels);
        PdoDescription p;
        p.transmission = 255;
        p.mapping = {map_entry(0x7130, 1, 16), map_entry(0x6150, 1, 8)};
        add_tpdo(d, 1, p);
        return d;
    }
    void attach(Device& d) override {
        Program::attach(d);
        inputs.attach(d, 2);
    }
    void on_reset(bool application) noexcept override {
        if (application) {
            inputs.reset();
        }
    }
    void step(Time now) noexcept override {
        for (unsigned n = 0; n < 2; ++n) {
            inputs.sample(n, field[n], counts, 0, now);
        }
        if (inputs.changed(0)) {
            inputs.mark_sent(0);
            device_->pdos().trigger(1);
        }
    }
};

struct AnalogInput : testing::Test {
    Transmitter program;
    Bench bench{program, {.node_id = 5, .pdo = {.send_at_start = false}}};

    void SetUp() override {
        bench.start();
        bench.run(5 * millisecond);
    }
    void field(double value) {
        program.field[0] = value;
        bench.run(3 * millisecond);
    }
    template <class T>
    void put(std::uint16_t index, T value, std::uint8_t sub = 1) {
        EXPECT_EQ(bench.write<T>(index, sub, value), Abort::none) << std::hex << index;
        bench.run(2 * millisecond);
    }
    float process() { return bench.read<float>(0x6130, 1); }
    void two_points() {
        put(0x6120, 4.0F);
        put(0x6121, 0.0F);
        put(0x6122, 20.0F);
        put(0x6123, 400.0F);
    }
    std::size_t sent() {
        const auto count = bench.sent(0x185).size();
        bench.forget();
        return count;
    }
};

TEST_F(AnalogInput, Starts_with_the_process_value_being_the_field_value) {
    field(7.25);
    EXPECT_FLOAT_EQ(bench.read<float>(0x6100, 1), 7.25F);
    EXPECT_FLOAT_EQ(process(), 7.25F);
    EXPECT_EQ(bench.read<std::uint16_t>(0x6110, 1), 40);
    EXPECT_EQ(bench.read<std::uint32_t>(0x6131, 1), 0x004e0000U);
    EXPECT_EQ(bench.read<std::uint8_t>(0x6112, 1), 1);
}

TEST_F(AnalogInput, Two_points_make_the_line_through_them) {
    two_points();
    for (const auto& [in, out] :
         {std::pair(4.0, 0.0F), {12.0, 200.0F}, {20.0, 400.0F}, {22.0, 450.0F}}) {
        field(in);
        EXPECT_NEAR(process(), out, 1e-3F);
    }
    EXPECT_NEAR(bench.read<float>(0x6126, 1), 25.0F, 1e-5F);
    EXPECT_NEAR(bench.read<float>(0x6127, 1), -100.0F, 1e-4F);
}

TEST_F(AnalogInput, Factor_and_scaling_offset_are_the_same_line) {
    put(0x6126, 2.0F);
    put(0x6127, 5.0F);
    field(3);
    EXPECT_FLOAT_EQ(process(), 11.0F);
    EXPECT_FLOAT_EQ(bench.read<float>(0x6121, 1), 5.0F);
    EXPECT_FLOAT_EQ(bench.read<float>(0x6123, 1), 7.0F);
}

TEST_F(AnalogInput, Points_that_are_one_change_nothing) {
    put(0x6122, 0.0F);
    field(3);
    EXPECT_FLOAT_EQ(process(), 3.0F);
}

TEST_F(AnalogInput, Families_show_one_value_each_in_its_type) {
    two_points();
    field(12);
    EXPECT_EQ(bench.read<std::int16_t>(0x7130, 1), 2000) << "one decimal digit";
    EXPECT_EQ(bench.read<std::int32_t>(0x9130, 1), 2000);
    std::vector<std::uint8_t> three;
    EXPECT_EQ(bench.read(0x8130, 1, three), Abort::none);
    EXPECT_EQ(three, (std::vector<std::uint8_t>{0xd0, 0x07, 0x00}));
    put(0x6132, std::uint8_t{6});
    EXPECT_EQ(bench.read<std::int16_t>(0x7130, 1), 32767) << "cut off, not wrapped";
    EXPECT_EQ(bench.read(0x8130, 1, three), Abort::none);
    EXPECT_EQ(three, (std::vector<std::uint8_t>{0xff, 0xff, 0x7f}));
    EXPECT_EQ(bench.read<std::int32_t>(0x9130, 1), 200'000'000);
    EXPECT_EQ(bench.write<std::uint8_t>(0x6132, 1, 7), Abort::too_high);
}

TEST_F(AnalogInput, What_is_written_by_one_family_is_seen_by_all) {
    put(0x7124, std::int16_t{-25});  // 2.5 with one digit
    EXPECT_FLOAT_EQ(bench.read<float>(0x6124, 1), -2.5F);
    EXPECT_EQ(bench.read<std::int32_t>(0x9124, 1), -25);
    const std::uint8_t minus_70[] = {0xba, 0xff, 0xff};
    EXPECT_EQ(bench.write(0x8124, 1, minus_70), Abort::none);
    EXPECT_FLOAT_EQ(bench.read<float>(0x6124, 1), -7.0F);
    put(0x9120, std::int32_t{40});
    put(0x9121, std::int32_t{0});
    put(0x9122, std::int32_t{200});

    put(0x9123, std::int32_t{4000});
    EXPECT_NEAR(bench.read<float>(0x6126, 1), 25.0F, 1e-5F);
    program.counts = -1234;
    field(1);
    EXPECT_EQ(bench.read<std::int16_t>(0x7100, 1), -1234) << "the converter's own";
}

TEST_F(AnalogInput, Autozero_and_autotare_need_their_words) {
    field(3);
    EXPECT_EQ(bench.write<std::uint32_t>(0x6125, 1, 1), Abort::cannot_store);
    EXPECT_EQ(bench.write<std::uint32_t>(0x6139, 1, 1), Abort::cannot_store);
    put(0x6139, std::uint32_t{0x65726174});
    EXPECT_FLOAT_EQ(process(), 3.0F);
    EXPECT_FLOAT_EQ(bench.read<float>(0x6140, 1), 0.0F);
    EXPECT_FLOAT_EQ(bench.read<float>(0x6138, 1), 3.0F);
    put(0x6125, std::uint32_t{0x6f72657a});
    EXPECT_FLOAT_EQ(process(), 0.0F);
    EXPECT_FLOAT_EQ(bench.read<float>(0x6124, 1), -3.0F);
    EXPECT_FLOAT_EQ(bench.read<float>(0x6124, 2), 0.0F) << "the other channel has its own";
}

TEST_F(AnalogInput, Channel_that_is_off_keeps_its_value_and_says_that_it_is_not_valid) {
    field(3);
    put(0x6112, std::uint8_t{0});
    field(8);
    EXPECT_FLOAT_EQ(process(), 3.0F);
    EXPECT_EQ(bench.read<std::uint8_t>(0x6150, 1), AnalogInputs::not_valid);
    put(0x6112, std::uint8_t{1});
    field(8);
    EXPECT_FLOAT_EQ(process(), 8.0F);
    EXPECT_EQ(bench.read<std::uint8_t>(0x6150, 1), 0);
    EXPECT_EQ(bench.write<std::uint8_t>(0x6112, 1, 2), Abort::value);
}

TEST_F(AnalogInput, Sample_rate_is_how_often_it_looks) {
    field(3);
    put(0x6114, std::uint32_t{50'000});
    field(3);
    bench.run(60 * millisecond);
    program.field[0] = 8;
    int taken = 0;
    for (; taken < 100 && program.inputs.field(0) != 8; ++taken) {
        bench.run(millisecond);
    }
    EXPECT_GT(taken, 10);
    EXPECT_LE(taken, 51);
}

TEST_F(AnalogInput, Change_beyond_the_delta_sends_the_PDO_and_nothing_else_does) {
    put(0x6133, 2.0F);
    field(0);
    sent();
    field(1.9);
    EXPECT_EQ(sent(), 0U);
    field(2.1);
    EXPECT_EQ(sent(), 1U);
    field(2.1);
    bench.run(100 * millisecond);
    EXPECT_EQ(sent(), 0U);
    field(0.2);
    EXPECT_EQ(sent(), 0U);
    field(0.0);
    EXPECT_EQ(sent(), 1U) << "the delta counts from the value sent last";
    EXPECT_EQ(bench.write<float>(0x6133, 1, -1.0F), Abort::too_low);
    EXPECT_EQ(bench.write<std::int16_t>(0x7133, 1, -1), Abort::too_low);
}

TEST_F(AnalogInput, Passing_a_limit_sends_the_PDO_once_each_way) {
    put(0x6133, 1000.0F);
    put(0x6134, -5.0F);
    put(0x6135, 5.0F);
    field(0);
    sent();
    field(4.9);
    EXPECT_EQ(sent(), 0U);
    field(5.1);
    EXPECT_EQ(sent(), 1U);
    field(50);
    EXPECT_EQ(sent(), 0U);
    field(4);
    EXPECT_EQ(sent(), 1U);
    field(-6);
    EXPECT_EQ(sent(), 1U);
}

TEST_F(AnalogInput, Numbers_that_are_none_are_refused) {
    for (const std::uint16_t index : std::initializer_list<std::uint16_t>{
             0x6120, 0x6121, 0x6124, 0x6126, 0x6133, 0x6134, 0x6138}) {
        EXPECT_EQ(bench.write<float>(index, 1, std::numeric_limits<float>::quiet_NaN()),
                  Abort::value);
        EXPECT_EQ(bench.write<float>(index, 1, std::numeric_limits<float>::infinity()),
                  Abort::value);
    }
}

TEST_F(AnalogInput, Reset_of_the_node_brings_its_first_parameters_back) {
    two_points();
    put(0x6124, 7.0F);
    bench.command(NmtCommand::reset_node);
    bench.command(NmtCommand::start);
    field(3);
    EXPECT_FLOAT_EQ(process(), 3.0F);
}

TEST(AnalogInputOfJr3, Is_the_same_block) {
    Jr3 jr3{Jr3Settings{}};
    Bench bench{jr3, {.node_id = 0x50}};
    jr3.set_wrench({10, 0, 0, 0, 0, 0});
    bench.start();
    bench.run(20 * millisecond);
    EXPECT_EQ(bench.write<float>(0x6122, 1, 100.0F), Abort::none);
    EXPECT_EQ(bench.write<float>(0x6123, 1, 50.0F), Abort::none);
    bench.run(5 * millisecond);
    EXPECT_NEAR(bench.read<float>(0x6130, 1), 5.0F, 0.03F);
    EXPECT_NEAR(bench.read<std::int16_t>(0x7130, 1), 500, 3);
    EXPECT_EQ(bench.read<std::uint32_t>(0x6131, 1), 0x00210000U);
    EXPECT_EQ(bench.read<std::uint8_t>(0x6112, 6), 1);
}

}  // namespace
}  // namespace hal::canopen::test
