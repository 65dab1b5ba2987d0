// SPDX-License-Identifier: MIT
// The torch height control of thc and thcud; they differ in what asks for a correction.
#pragma once

#include <algorithm>
#include <cmath>

#include "hal/component.hpp"
#include "hal/retained.hpp"

/// The pins that thc and thcud share, and the correction of Z.
struct TorchHeight : hal::Component {
    using Component::Component;
    static constexpr hal::Traits traits{.singleton = true};

    hal::In<double> current_vel{*this, "current-vel", "current velocity (motion.current-vel)"};
    hal::In<double> requested_vel{*this, "requested-vel",
                                  "requested velocity (motion.requested-vel)"};
    hal::In<bool> torch_on{*this, "torch-on", "TRUE while the torch is switched on"};
    hal::In<bool> arc_ok{*this, "arc-ok", "TRUE while the arc is stable"};
    hal::In<bool> enable{*this, "enable",
                         "enables the correction; FALSE clears it and passes Z through"};
    hal::In<double> z_pos_in{*this, "z-pos-in", "commanded Z position"};
    hal::Out<double> z_pos_out{*this, "z-pos-out", "commanded Z position with the correction"};
    hal::Out<double> z_fb_out{*this, "z-fb-out",
                              "Z position feedback for motion, without the correction"};
    hal::Out<bool> vel_status{*this, "vel-status",
                              "TRUE while enabled, moving, and not slower than requested"};
    hal::Param<double> velocity_tol{*this,
                                    "velocity-tol",
                                    "how much slower than requested a corrected motion may be",
                                    {.unit = "%"}};

protected:
    /// Updates the correction and the shared outputs. `direction()` returns above 0 to raise the
    /// torch, below 0 to lower it, 0 to hold; it is asked only while a correction is allowed.
    /// `step` is the change of the correction per cycle. Returns true while the torch is off and
    /// the correction is being removed. [realtime]
    template <class Direction>
    bool control(Direction direction, double step) noexcept {
        const double z = z_pos_in;
        const double up = z - last_z_;
        // In a corner the velocity drops, and the arc voltage no longer measures the height.
        const double min_vel = requested_vel - requested_vel * (velocity_tol * 0.01);
        const bool steady = enable && current_vel > 0.0 && current_vel >= min_vel;
        bool removing = false;
        if (!enable) {
            offset_ = 0.0;
        } else if (!torch_on) {
            removing = offset_ != 0.0;
            if (up > 0.0) {
                offset_ -= std::clamp(offset_, -up, up);
            }
        } else if (arc_ok && steady) {
            const int sign = direction();
            const double next = offset_ + sign * step;
            if (std::fabs(next) <= 1e9) {
                offset_ = next;  // FALSE for NaN, too
            }
        }
        last_z_ = z;
        vel_status = steady;
        z_pos_out = z + offset_;
        z_fb_out = z;
        return removing;
    }
    double offset() const noexcept { return offset_; }

private:
    double offset_ = 0.0;

private:
    double last_z_ = 0.0;
    hal::Retained retained_{*this, {{"offset", offset_}, {"last-z", last_z_}}};
};
