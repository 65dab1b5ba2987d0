// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace hal::modbus {

/// A motor behind a frequency converter: it follows its set-point with a ramp. Not real time.
struct DriveModel {
    double max_speed_rpm = 24000;
    double ramp_s = 2.0;  ///< from 0 to full speed
    int direction = 0;    ///< 1, -1, 0: ramps to a stop
    double set_point_rpm = 0.0;
    bool is_tripped = false;
    bool is_blocked = false;  ///< the shaft does not turn
    double speed_rpm = 0.0;   ///< with sign
    double load_percent = 0.0;

    /// Moves on to a time.
    void advance(std::int64_t now_ns) {
        const double dt = last_ns_ == 0 ? 0.0 : static_cast<double>(now_ns - last_ns_) * 1e-9;
        last_ns_ = now_ns;
        if (is_tripped) {
            direction = 0;
        }
        const double target = direction * std::min(set_point_rpm, max_speed_rpm);
        const double step = max_speed_rpm / ramp_s * dt;
        const double before = speed_rpm;
        speed_rpm = is_blocked ? 0.0 : speed_rpm + std::clamp(target - speed_rpm, -step, step);
        const bool works = is_blocked && direction != 0;
        const bool speeds_up = std::fabs(speed_rpm) > std::fabs(before);
        load_percent = 0.0;
        if (works) {
            load_percent = 150.0;
        } else if (speed_rpm != 0.0) {
            load_percent = speeds_up ? 80.0 : 20.0;
        }
    }

private:
    std::int64_t last_ns_ = 0;
};

}  // namespace hal::modbus
