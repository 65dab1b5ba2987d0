// SPDX-License-Identifier: MIT
// A drive on its bench in a mode in which it makes its own set-points.
#pragma once

#include "drive_bench.hpp"

namespace hal::canopen::test {

struct DriveProfile : DriveBench {
    void ready(Mode mode) {
        settings.axis[0].motor.endless();
        make();
        set(object::profile_velocity, 40000);
        set(object::profile_acceleration, 100000);
        set(object::profile_deceleration, 200000);
        enable(mode);
    }
    bool reached() { return bit(status::target_reached); }
    bool acknowledged() { return bit(status::set_point_acknowledge); }
    void go(std::int32_t target, std::uint16_t bits = 0) {
        set(object::target_position, target);
        control(static_cast<std::uint16_t>(0x1f | bits));
        EXPECT_TRUE(acknowledged());
        control(static_cast<std::uint16_t>(0x0f | bits));
    }
    std::int32_t demand() { return get<std::int32_t>(object::position_demand); }
    std::int32_t demanded_velocity() { return get<std::int32_t>(object::velocity_demand); }
};

}  // namespace hal::canopen::test
