// SPDX-License-Identifier: MIT
// Second-order sections of filter_biquad and notch.
#pragma once

#include <cmath>
#include <numbers>

namespace hal::estimation {

/// H(z) = (b0 + b1/z + b2/z²) / (1 + a1/z + a2/z²).
struct Coefficients {
    double b0 = 1.0;
    double b1 = 0.0;
    double b2 = 0.0;
    double a1 = 0.0;
    double a2 = 0.0;
};

enum class Shape { low_pass, high_pass, band_pass, notch, peak };

/// A section with its corner or centre at `frequency` (as a part of the rate, above 0 and below
/// 0.5) and the quality `q`; `gain` is that of the peak, and of the notch at its deepest (R.
/// Bristow-Johnson, *Cookbook formulae for audio EQ biquad filter coefficients*). [realtime]
inline Coefficients section(Shape shape, double frequency, double q, double gain) noexcept {
    const double w = 2.0 * std::numbers::pi * frequency;
    const double cos = std::cos(w);

    const double alpha = std::sin(w) / (2.0 * q);
    double b0 = 1.0;
    double b1 = 0.0;
    double b2 = 0.0;
    double a0 = 1.0 + alpha;
    double a2 = 1.0 - alpha;
    const double a1 = -2.0 * cos;
    switch (shape) {
    case Shape::low_pass:
        b0 = b2 = (1.0 - cos) / 2.0;
        b1 = 1.0 - cos;
        break;
    case Shape::high_pass:
        b0 = b2 = (1.0 + cos) / 2.0;
        b1 = -1.0 - cos;
        break;
    case Shape::band_pass:
        b0 = alpha;
        b2 = -alpha;
        break;
    case Shape::notch:
        b0 = 1.0 + gain * alpha;
        b1 = a1;
        b2 = 1.0 - gain * alpha;
        break;
    case Shape::peak: {
        const double a = std::sqrt(gain);
        b0 = 1.0 + alpha * a;
        b1 = a1;
        b2 = 1.0 - alpha * a;
        a0 = 1.0 + alpha / a;

        a2 = 1.0 - alpha / a;
        break;
    }
    }
    return {b0 / a0, b1 / a0, b2 / a0, a1 / a0, a2 / a0};
}

/// The state of one section, transposed direct form II.
struct Section {
    double s1 = 0.0;
    double s2 = 0.0;

    /// [realtime]
    double step(const Coefficients& c, double x) noexcept {
        const double y = c.b0 * x + s1;
        s1 = c.b1 * x - c.a1 * y + s2;
        s2 = c.b2 * x - c.a2 * y;
        return y;
    }
    /// Sets the steady state for this input. [realtime]
    void settle(const Coefficients& c, double x) noexcept {
        const double y = x * (c.b0 + c.b1 + c.b2) / (1.0 + c.a1 + c.a2);
        s2 = c.b2 * x - c.a2 * y;
        s1 = c.b1 * x - c.a1 * y + s2;
        if (!std::isfinite(s1 + s2)) {
            s1 = s2 = 0.0;
        }
    }
};

}  // namespace hal::estimation
