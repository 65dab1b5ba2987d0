// SPDX-License-Identifier: MIT
#include "cia402/drive/axis_objects.hpp"

#include <algorithm>
#include <iterator>

namespace hal::cia402 {

const char* name_of_record(std::uint16_t index) noexcept {
    struct Record {
        std::uint16_t index;
        const char* name;
    };
    using namespace object;
    static constexpr Record records[] = {
        {vl_velocity_min_max, "vl velocity min max amount"},
        {vl_velocity_acceleration, "vl velocity acceleration"},
        {vl_velocity_deceleration, "vl velocity deceleration"},
        {vl_velocity_quick_stop, "vl velocity quick stop"},
        {vl_set_point_factor, "vl set-point factor"},
        {vl_dimension_factor, "vl dimension factor"},
        {position_range_limit, "Position range limit"},
        {software_position_limit, "Software position limit"},
        {profile_jerk, "Profile jerk"},
        {position_encoder_resolution, "Position encoder resolution"},
        {velocity_encoder_resolution, "Velocity encoder resolution"},
        {gear_ratio, "Gear ratio"},
        {feed_constant, "Feed constant"},
        {velocity_factor, "Velocity factor"},
        {acceleration_factor, "Acceleration factor"},
        {homing_speeds, "Homing speeds"},
        {interpolation_data, "Interpolation data record"},
        {interpolation_period, "Interpolation time period"},
        {interpolation_configuration, "Interpolation data configuration"},
        {supported_homing_methods, "Supported homing methods"},
        {additional_position, "Additional position actual value"},
        {digital_outputs, "Digital outputs"},
    };
    const auto* const found = std::ranges::find(records, index, &Record::index);
    return found != std::end(records) ? found->name : "";
}

}  // namespace hal::cia402
