// SPDX-License-Identifier: MIT
// The electrical side of a brushed DC motor behind a current-limited amplifier.
#pragma once

#include <algorithm>
#include <cmath>

namespace sim {

/// Winding and amplifier: L di/dt = u - R i - k w, |i| <= limit. SI units; k is both torque
/// constant (N·m/A) and back-EMF constant (V·s/rad).
struct Winding {
    double resistance, inductance, constant, current_limit;  // current_limit 0: none

    /// The current after `dt` seconds at constant voltage and speed: the exact solution, so any dt
    /// is stable. An inductance of 0 is allowed. [any]
    double step(double current, double voltage, double speed, double dt) const noexcept {
        if (!(resistance > 0.0)) return 0.0;
        const double settled = (voltage - constant * speed) / resistance;
        const double next = inductance > 0.0 ? settled + (current - settled) *
                                                             std::exp(-dt * resistance / inductance)
                                             : settled;
        return current_limit > 0.0 ? std::clamp(next, -current_limit, current_limit) : next;
    }
};

/// Coulomb friction smoothed around standstill, so that an explicit integrator can take it: within
/// a few hundredths of a radian per second it fades to 0. [any]
inline double coulomb(double torque, double speed) noexcept {
    constexpr double smoothing = 0.01;  // rad/s
    return torque * std::tanh(speed / smoothing);
}

}  // namespace sim
