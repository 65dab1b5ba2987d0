// SPDX-License-Identifier: MIT
#include <numbers>

#include "hal/component.hpp"
#include "hal/edge.hpp"
#include "hal/retained.hpp"

namespace {

/// A parameter that the component sets as well.
class Coefficient : public hal::Param<double> {
public:
    using Param::Param;
    void set(double value) noexcept { put(value); }
};

// H(z) = (n0 + n1 z^-1 + n2 z^-2) / (1 + d1 z^-1 + d2 z^-2), transposed direct form II. The
// coefficients are Robert Bristow-Johnson's (Cookbook formulae for audio EQ biquad filter
// coefficients), with w = 2 pi f0 / rate:
//     low pass: n0 = n2 = (1 - cos w) / 2 / a,  n1 = (1 - cos w) / a
//     notch:    n0 = n2 = 1 / a,                n1 = -2 cos w / a
//     both:     d1 = -2 cos w / a,              d2 = (1 - s) / a       with s = sin w / (2 Q), a = 1 + s
struct Biquad : hal::Component {
    using Component::Component;
    hal::In<double> in{*this, "in", "input"};
    hal::Out<double> out{*this, "out", "filtered input"};
    hal::In<bool> enable{*this, "enable",
                         "a rising edge designs the filter; FALSE copies in to out"};
    hal::Out<bool> valid{*this, "valid",
                         "TRUE: the parameters are valid; FALSE: in is copied to out"};
    hal::In<std::uint32_t> type{*this, "type",
                                "0: user-defined by n0 to d2; 1: low pass; 2: notch"};
    hal::In<double> f0{*this,
                       "f0",
                       "corner or notch frequency, at most half the rate of the thread",
                       {.initial = 250.0, .unit = "Hz"}};
    hal::In<double> q{*this, "Q", "quality of the filter, 0.5 to 2", {.initial = 0.7071}};
    hal::Out<double> s1{*this, "s1", "state for the next cycle"};
    hal::Out<double> s2{*this, "s2", "state for the cycle after next"};
    Coefficient n0{*this, "n0", "coefficient of the input", {.initial = 1.0}};
    Coefficient n1{*this, "n1", "coefficient of the input one cycle ago"};
    Coefficient n2{*this, "n2", "coefficient of the input two cycles ago"};
    Coefficient d1{*this, "d1", "negated coefficient of the output one cycle ago"};
    Coefficient d2{*this, "d2", "negated coefficient of the output two cycles ago"};
    hal::Function run{*this, "", &Biquad::update, "filters"};

    void update(hal::Cycle cycle) noexcept {
        if (enable_edge_.rises(enable)) {
            valid = design(cycle.seconds());
        }
        const double x = in;
        if (!enable || !valid) {
            out = x;
            return;
        }
        const double y = n0 * x + s1;
        const double next1 = n1 * x - d1 * y + s2;
        const double next2 = n2 * x - d2 * y;
        if (std::isfinite(y + next1 + next2)) {
            s1 = next1;
            s2 = next2;
            out = y;
        } else if (std::isfinite(x)) {  // the filter has diverged
            clear();
            out = x;
        }  // NaN: the output keeps its value
    }

private:
    void clear() noexcept {
        s1 = 0.0;
        s2 = 0.0;
    }

    bool design(double dt) noexcept {
        if (type == 0) return std::isfinite(n0 + n1 + n2 + d1 + d2);
        if (type > 2 || !(f0 > 0.0 && f0 * dt <= 0.5) || !(q >= 0.5 && q <= 2.0)) return false;
        const double w = 2.0 * std::numbers::pi * f0 * dt;
        const double cosine = std::cos(w);

        const double s = std::sin(w) / (2.0 * q);
        const double a = 1.0 + s;
        const double outer = type == 1 ? (1.0 - cosine) / 2.0 : 1.0;

        const double middle = type == 1 ? 1.0 - cosine : -2.0 * cosine;
        n0.set(outer / a);
        n1.set(middle / a);
        n2.set(outer / a);
        d1.set(-2.0 * cosine / a);
        d2.set((1.0 - s) / a);
        clear();
        return true;
    }

    hal::RisingEdge enable_edge_;
    hal::Retained retained_{*this, {{"was-enabled", enable_edge_}}};
};

}  // namespace

HAL_COMPONENT(Biquad, "biquad", "Second-order filter: low pass, notch or user-defined", R"(
    H(z) = (n0 + n1/z + n2/z²) / (1 + d1/z + d2/z²)

A rising edge of `enable` designs the filter: `type` 1 (low pass) and 2 (notch) compute the
parameters from `f0` and `Q` and clear `s1` and `s2`; `type` 0 uses the parameters and the state as
they are. `f0` must be above 0 and at most half the rate of the thread, `Q` in 0.5..2; otherwise
`valid` is FALSE and `in` is copied to `out`. While the input is NaN or infinite, `out` keeps its
value; a filter that diverges is cleared.

**Differences from LinuxCNC:** an `f0` of 0 or below is invalid (LinuxCNC: the filter diverges), and
so are NaN parameters; `out` recovers from NaN.

    # remove the 50 Hz hum of a force sensor
    loadrt biquad names=no-hum
    addf no-hum servo
    setp no-hum.type 2
    setp no-hum.f0 50
    setp no-hum.enable TRUE
    net force-raw => no-hum.in
    net force     <= no-hum.out
)")
