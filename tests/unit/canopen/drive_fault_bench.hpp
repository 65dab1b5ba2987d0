// SPDX-License-Identifier: MIT
// A drive on its bench that moves, fails and is reset.
#pragma once

#include "drive_bench.hpp"

namespace hal::canopen::test {

struct DriveFault : DriveBench {
    void moving(Mode mode = Mode::profile_velocity) {
        settings.axis[0].motor.endless();
        make();
        enable(mode);
        set(object::target_velocity, 20000);
        run(300);
        sent.clear();
    }
    /// One fault: reaction, code, EMCY with the axis, and after the cause is gone the reset and its
    /// EMCY.
    void expect_fault(std::uint16_t code, std::uint8_t register_bit, unsigned axis = 0) {
        ASSERT_TRUE(until([&] { return state(axis) == State::fault; }, 2000)) << state(axis);
        EXPECT_EQ(get<std::uint16_t>(object::error_code, axis), code);
        const auto told = emergencies();
        ASSERT_FALSE(told.empty());
        EXPECT_EQ(told.back().code, code);
        EXPECT_EQ(told.back().error_register, register_bit | error_generic);
        EXPECT_EQ(told.back().manufacturer[0], axis);
        EXPECT_EQ(device().dictionary().get<std::uint8_t>(0x1001, 0), register_bit | error_generic);
        EXPECT_EQ(device().dictionary().get<std::uint32_t>(0x1003, 1) & 0xffff, code);
    }
    void expect_reset(unsigned axis = 0) {
        sent.clear();
        control(0, axis);
        control(command::fault_reset, axis);
        EXPECT_EQ(state(axis), State::switch_on_disabled);
        EXPECT_EQ(get<std::uint16_t>(object::error_code, axis), 0);
        const auto told = emergencies();
        ASSERT_EQ(told.size(), 1U);
        EXPECT_EQ(told[0].code, 0);
        EXPECT_EQ(told[0].error_register, 0);
    }
};

}  // namespace hal::canopen::test
