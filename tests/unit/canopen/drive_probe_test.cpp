// SPDX-License-Identifier: MIT
// Touch probes, inputs and outputs.
#include "drive_fault_bench.hpp"
namespace hal::canopen::test {
namespace {

struct DriveProbe : DriveFault {
    void at(double from, double to) {
        settings.axis[0].motor.endless();
        settings.axis[0].motor.probe_from[0] = from;
        settings.axis[0].motor.probe_to[0] = to;
        make();
        enable(Mode::profile_velocity);
    }
    std::uint16_t probes() { return get<std::uint16_t>(object::touch_probe_status); }
    std::int32_t found(unsigned n) {
        return get<std::int32_t>(static_cast<std::uint16_t>(object::touch_probe_1_positive + n));
    }
    void pass(int velocity) {
        set(object::target_velocity, velocity);
        run(1000);
        set(object::target_velocity, 0);
        run(500);
    }
};
TEST_F(DriveProbe, Both_edges_to_the_increment) {
    at(7001, 9003);
    set(object::touch_probe_function, probe::enable | probe::positive_edge | probe::negative_edge);
    run(1);
    EXPECT_EQ(probes() & 7, probe::enabled);
    pass(20000);
    EXPECT_EQ(probes() & 7, probe::enabled | probe::positive_stored | probe::negative_stored);
    EXPECT_EQ(found(0), 7001);
    EXPECT_EQ(found(1), 9003);
    pass(-20000);  // it was the first edge that counts
    EXPECT_EQ(found(0), 7001);
    set(object::touch_probe_function, 0);
    run(1);
    EXPECT_EQ(probes(), 0);
    set(object::touch_probe_function, probe::enable | probe::positive_edge);
    pass(20000);
    pass(-20000);
    EXPECT_EQ(found(0), 7001);
    EXPECT_EQ(probes() & 7, probe::enabled | probe::positive_stored);
}
TEST_F(DriveProbe, Continuous_takes_every_edge_and_toggles) {
    at(7001, 9003);
    set(object::touch_probe_function, probe::enable | probe::continuous | probe::positive_edge);
    pass(20000);
    EXPECT_EQ(found(0), 7001);
    const auto toggle = probes() & probe::updated;
    pass(-20000);
    EXPECT_EQ(found(0), 9003);  // comes in from the other side
    EXPECT_NE(probes() & probe::updated, toggle);
}
TEST_F(DriveProbe, Index_pulse_can_be_the_trigger) {
    at(0, 0);
    pass(3000);
    set(object::touch_probe_function, probe::enable | probe::index_pulse | probe::positive_edge);
    pass(20000);
    EXPECT_EQ(found(0), 4096);
}
TEST_F(DriveProbe, Inputs_from_outside_trigger_probe_2) {
    at(0, 0);
    settings.axis[0].motor.probe_from = settings.axis[0].motor.probe_to = {0, 0};
    make();
    enable(Mode::profile_velocity);
    set(object::target_velocity, 10000);
    set(object::touch_probe_function, (probe::enable | probe::positive_edge | probe::negative_edge)
                                          << 8);
    run(500);
    drive->set_inputs(0, input::probe_2);
    run(1);
    const auto at_edge = position();
    EXPECT_NE(get<std::uint32_t>(object::digital_inputs) & input::probe_2, 0U);
    run(100);
    drive->set_inputs(0, 0);
    run(100);
    EXPECT_EQ(probes(), probes() & 0xff00);
    EXPECT_NEAR(found(2), at_edge, 1);
    EXPECT_NEAR(found(3), at_edge + 1010, 15);
}
TEST_F(DriveProbe, Unknown_triggers_are_refused) {
    at(0, 0);
    EXPECT_EQ(write(object::touch_probe_function, 0, 0x08), Abort::value);
    EXPECT_EQ(write(object::touch_probe_function, 0, 0x0900), Abort::value);
}

TEST_F(DriveFault, Outputs_act_under_their_mask) {
    settings.axis[0].motor.brake_torque = 1;
    make();
    set(object::digital_outputs, 0x00030001, 0, 1);
    EXPECT_EQ(drive->status(0).outputs, 0U);
    set(object::digital_outputs, 0x00010000, 0, 2);
    EXPECT_EQ(drive->status(0).outputs, 0x10000U);
    enable(Mode::profile_velocity);
    run(50);
    EXPECT_FALSE(drive->status(0).brake_closed);
    set(object::digital_outputs, 0x00010001, 0, 2);
    EXPECT_TRUE(drive->status(0).brake_closed);
}

}  // namespace
}  // namespace hal::canopen::test
