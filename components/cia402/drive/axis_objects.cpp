// SPDX-License-Identifier: MIT
#include "cia402/drive/axis_objects.hpp"

namespace hal::cia402 {

const char* name_of_record(std::uint16_t index) noexcept {
    using namespace object;
    switch (index) {
    case vl_velocity_min_max: return "vl velocity min max amount";
    case vl_velocity_acceleration: return "vl velocity acceleration";
    case vl_velocity_deceleration: return "vl velocity deceleration";
    case vl_velocity_quick_stop: return "vl velocity quick stop";
    case vl_set_point_factor: return "vl set-point factor";
    case vl_dimension_factor: return "vl dimension factor";
    case position_range_limit: return "Position range limit";
    case software_position_limit: return "Software position limit";
    case profile_jerk: return "Profile jerk";
    case position_encoder_resolution: return "Position encoder resolution";
    case velocity_encoder_resolution: return "Velocity encoder resolution";
    case gear_ratio: return "Gear ratio";
    case feed_constant: return "Feed constant";
    case velocity_factor: return "Velocity factor";
    case acceleration_factor: return "Acceleration factor";
    case homing_speeds: return "Homing speeds";
    case interpolation_data: return "Interpolation data record";
    case interpolation_period: return "Interpolation time period";
    case interpolation_configuration: return "Interpolation data configuration";
    case supported_homing_methods: return "Supported homing methods";
    case additional_position: return "Additional position actual value";
    case digital_outputs: return "Digital outputs";
    default: return "";
    }
}

}  // namespace hal::cia402
