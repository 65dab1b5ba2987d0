// SPDX-License-Identifier: MIT
#include "canopen/device/drive/drive_program.hpp"
#include "device_bench.hpp"

namespace hal::canopen::test {
namespace {

DriveSettings two_wheels() {
    DriveSettings settings;
    settings.axes = 2;
    for (auto& axis : settings.axis) {
        axis.motor.endless();
    }
    return settings;
}

struct DriveNode : testing::Test {
    DriveProgram program{two_wheels()};
    Bench bench{program};
    void SetUp() override {
        bench.start();
        bench.run(20 * millisecond);
    }
    void enable(unsigned axis) {
        for (const int word : {0x06, 0x07, 0x0f}) {
            ASSERT_EQ(
                bench.write(cia402::of_axis(0x6040, axis), 0, static_cast<std::uint16_t>(word)),
                Abort::none);
            bench.run(50 * millisecond);
        }
    }
};

TEST_F(DriveNode, moves_the_axis_it_is_told_to) {
    // profile velocity, second axis
    ASSERT_EQ(bench.write<std::int8_t>(0x6860, 0, 3), Abort::none);
    enable(1);
    ASSERT_EQ(bench.write<std::int32_t>(0x68ff, 0, 4096), Abort::none);
    bench.run(2 * second);
    EXPECT_NEAR(program.drive().status(1).speed, 60, 1);  // a revolution per second
    EXPECT_EQ(program.drive().status(0).speed, 0);
    EXPECT_EQ(
        program.summary(),
        "axis 0 switch on disabled, profile position; axis 1 operation enabled, profile velocity");
}

TEST_F(DriveNode, feels_what_is_done_to_it) {
    enable(0);
    ASSERT_TRUE(program.set("load-torque-0", 0.1));
    bench.run(second);
    EXPECT_NEAR(std::abs(program.drive().status(0).torque), 0.1, 0.03);
    ASSERT_TRUE(program.set("dc-link-0", 20));
    bench.run(100 * millisecond);
    EXPECT_EQ(program.drive().status(0).state, cia402::State::fault);
    EXPECT_EQ(bench.remote().emergency(0).code, cia402::error::under_voltage);
    EXPECT_NE(program.summary().find("error DC link under-voltage"), std::string::npos);
    for (const auto& name : program.settable()) {
        EXPECT_TRUE(program.set(name, 0)) << name;
    }
    for (const char* name :
         {"load-torque", "load-torque-2", "load-torque-x", "load-torque-00", "weight-0"}) {
        EXPECT_FALSE(program.set(name, 0)) << name;
    }
}

TEST_F(DriveNode, is_off_after_its_power_failed) {
    enable(0);
    EXPECT_EQ(program.drive().status(0).state, cia402::State::operation_enabled);
    bench.node.power(false);
    bench.run(100 * millisecond);
    bench.node.power(true);
    bench.run(100 * millisecond);
    EXPECT_EQ(bench.node.device().state(), NmtState::pre_operational);
    EXPECT_EQ(program.drive().status(0).state, cia402::State::switch_on_disabled);
    EXPECT_EQ(bench.remote().boot_ups(), 2U);
}

TEST(Motor, is_read_from_text) {
    cia402::MotorSettings motor;
    EXPECT_EQ(parse_motor("", motor), "");
    EXPECT_EQ(parse_motor("inertia:1e-4,resolution=8192,home-from:-5", motor), "");
    EXPECT_EQ(motor.inertia, 1e-4);
    EXPECT_EQ(motor.resolution, 8192U);
    EXPECT_EQ(motor.home_from, -5);
    EXPECT_EQ(parse_motor("endless:1", motor), "");
    EXPECT_EQ(motor.positive_limit, std::numeric_limits<double>::infinity());
    const std::string rest =
        "'; write NAME:VALUE, as in inertia:1e-4; names: resolution, endless, inertia, ";
    for (const std::string wrong : {"inertia", "inertia:", "inertia:x", "inertia:0", "inertia:nan",
                                    "resolution:1.5", "weight:3", ":1"}) {
        EXPECT_TRUE(
            parse_motor(wrong, motor).starts_with("invalid motor parameter '" + wrong + rest))
            << wrong;
    }
}

}  // namespace
}  // namespace hal::canopen::test
