// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Lincurve : hal::Component {
    using Component::Component;
    hal::Argument count{*this, "personality", 2, "number of points", {.min = 1, .max = 16}};
    hal::In<double> in{*this, "in", "position on the x axis"};
    hal::Out<double> out{*this, "out", "value of the curve"};
    hal::Io<double> out_io{*this, "out-io", "like out, for signals with io pins"};
    hal::Params<double> x{*this, "x-val-##", count,
                          "x of point #; must not decrease from point to point"};
    hal::Params<double> y{*this, "y-val-##", count, "y of point #"};
    hal::Function run{*this, "", hal::step<&Lincurve::update>, "evaluates the curve"};

    void update(hal::Cycle) noexcept {
        const double value = in;
        if (std::isnan(value)) return;
        const double result = at(value);
        out = result;
        out_io = result;
    }

private:
    double at(double value) const noexcept {
        if (value >= x[x.size() - 1]) return y[y.size() - 1];
        if (value <= x[0]) return y[0];
        for (std::size_t i = 1; i < x.size(); ++i) {
            if (!(value < x[i])) continue;
            const double width = x[i] - x[i - 1];
            return width > 0.0 && std::isfinite(width)
                       ? y[i - 1] + (y[i] - y[i - 1]) * ((value - x[i - 1]) / width)
                       : y[i - 1].get();
        }
        return y[y.size() - 1];
    }
};

}  // namespace

HAL_COMPONENT(Lincurve, "lincurve", "Piecewise linear curve through given points", R"(
`out` is the value at `in` of the curve through the points (`x-val-00`, `y-val-00`), (`x-val-01`,
`y-val-01`) …; before the first and after the last point it is constant. `personality` is the number
of points, up to 16. Two points with the same x are a step; at this x the value of the second one
applies. While `in` is NaN the output keeps its value.

    # a thermocouple
    loadrt lincurve personality=3 names=thermo
    addf thermo servo
    setp thermo.x-val-01 4.1
    setp thermo.y-val-01 100
    setp thermo.x-val-02 8.1
    setp thermo.y-val-02 200
    net thermo-millivolt => thermo.in
    net temperature      <= thermo.out
)")
