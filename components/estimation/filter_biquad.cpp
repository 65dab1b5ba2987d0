// SPDX-License-Identifier: MIT
#include <cmath>
#include <numbers>
#include <vector>

#include "estimation/sections.hpp"
#include "hal/component.hpp"
#include "hal/retained.hpp"

namespace {

using namespace hal::estimation;

struct FilterBiquad : hal::Component {
    explicit FilterBiquad(const hal_host* host)
        : Component(host),
          type(*this, "type", "lowpass",
               "lowpass, highpass (both Butterworth), bandpass, notch or peak"),
          order(*this, "order", 2,
                "order of lowpass and highpass: even, 2..12; otherwise the number of equal "
                "sections in series",
                {.min = 1, .max = 12}) {
        constexpr const char* names[] = {"lowpass", "highpass", "bandpass", "notch", "peak"};
        std::size_t found = 0;
        while (found < std::size(names) && type.get() != names[found]) {
            ++found;
        }
        if (found == std::size(names)) {
            throw hal::ArgumentError(
                "type",
                "type=" + type.get() + " is not lowpass, highpass, bandpass, notch or peak");
        }
        shape_ = static_cast<Shape>(found);
        const bool passes = shape_ == Shape::low_pass || shape_ == Shape::high_pass;
        if (passes && order % 2 != 0) {
            throw hal::ArgumentError("order", "order=" + std::to_string(order) + " is odd; use " +
                                                  std::to_string(order + 1));
        }
        sections_.resize(
            static_cast<std::size_t>(passes ? order / 2 : static_cast<std::int64_t>(order)));
        coefficients_.resize(sections_.size());
        hal::Retained(*this, {{"sections", sections_},
                              {"coefficients", coefficients_},
                              {"f", f_},
                              {"q", q_},
                              {"g", g_},
                              {"running", running_}});
    }

    hal::TextArgument type;
    hal::Argument order;
    hal::In<double> in{*this, "in", "input"};
    hal::Out<double> out{*this, "out", "filtered input", {.finite = true}};
    hal::In<bool> enable{*this, "enable", "FALSE copies in to out", {.initial = true}};
    hal::In<double> frequency{*this,
                              "frequency",
                              "corner or centre frequency; may change at any time",
                              {.initial = 100.0, .unit = "Hz"}};
    hal::In<double> quality{
        *this,
        "Q",
        "bandpass, notch and peak: centre frequency divided by bandwidth, of each section",
        {.initial = 2.0}};
    hal::In<double> gain{
        *this, "gain", "gain of a peak, or at the centre of a notch", {.initial = 0.0}};
    hal::Out<bool> valid{*this, "valid",
                         "FALSE: frequency is not between 0 and half the thread's rate, or Q or "
                         "gain is invalid; in is copied to out"};
    hal::Out<std::uint32_t> bad_inputs{*this, "bad-inputs",
                                       "number of NaN or infinite inputs; out keeps its value"};
    hal::Function run{*this, "", &FilterBiquad::update, "filters"};

    void update(hal::Cycle cycle) noexcept {
        const double now = in;
        const double f = frequency * cycle.seconds();
        const double q = quality;
        const double g = gain;
        if (f != f_ || q != q_ || g != g_) {
            design(f, q, g);
        }
        if (!std::isfinite(now)) {
            bad_inputs = bad_inputs + 1;
            return;
        }
        if (!enable || !valid) {
            running_ = false;
            out = now;
            return;
        }
        double y = now;
        for (std::size_t i = 0; i < sections_.size(); ++i) {
            if (!running_) {
                sections_[i].settle(coefficients_[i], y);
            }
            y = sections_[i].step(coefficients_[i], y);
        }
        running_ = std::isfinite(y);
        out = running_ ? y : now;
    }

private:
    void design(double f, double q, double g) noexcept {
        f_ = f;
        q_ = q;
        g_ = g;
        const bool passes = shape_ == Shape::low_pass || shape_ == Shape::high_pass;
        valid = f > 0.0 && f < 0.5 &&
                (passes ||
                 (q > 0.0 && q < 1e6 && g >= 0.0 && g < 1e6 && (shape_ != Shape::peak || g > 0.0)));
        if (!valid) return;
        for (std::size_t i = 0; i < sections_.size(); ++i) {
            // Butterworth poles are evenly spaced on a half circle: a pair at the angle pi (2i + 1)
            // / (2 order) has Q = 1 / (2 sin)
            const double angle = std::numbers::pi * static_cast<double>(2 * i + 1) /
                                 (4.0 * static_cast<double>(sections_.size()));
            coefficients_[i] = section(shape_, f, passes ? 0.5 / std::sin(angle) : q, g);
        }
    }

    Shape shape_ = Shape::low_pass;
    std::vector<Section> sections_;
    std::vector<Coefficients> coefficients_;
    double f_ = -1.0;
    double q_ = 0.0;
    double g_ = 0.0;
    bool running_ = false;
};

}  // namespace

HAL_COMPONENT(FilterBiquad, "filter_biquad",
              "Butterworth low and high pass of any even order, band pass, notch, peak", R"(
A series of second-order sections. `lowpass` and `highpass` are Butterworth filters of the given
`order`, 3 dB down at `frequency`; the others are `order` equal sections with the centre `frequency`
and the quality `Q` = `frequency` / bandwidth each. The bandwidth of one section is between the
frequencies at which a band pass or a notch (with `gain` 0) is 3 dB down, and a peak has half of its
gain in dB; that of two band passes in series is 0.64 of it. `lowpass` and `highpass` ignore `Q`.
`frequency` may change in every cycle, for example to track a resonance that depends on a speed. The
filter starts in the steady state of its first input, so its output does not jump.

Compared to LinuxCNC's `biquad`, which is also available, this filter starts without an edge and
supports more shapes and higher orders.

    loadrt filter_biquad names=quiet type=lowpass order=4
    addf quiet servo
    setp quiet.frequency 40
    net noisy => quiet.in
    net good  <= quiet.out
)")
