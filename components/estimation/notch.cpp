// SPDX-License-Identifier: MIT
#include <cmath>
#include <vector>

#include "estimation/sections.hpp"
#include "hal/component.hpp"
#include "hal/retained.hpp"

namespace {

using namespace hal::estimation;

struct Notch : hal::Component {
    explicit Notch(const hal_host* host)
        : Component(host),
          harmonics(*this, "harmonics", 1, "number of notches: at the frequency and its multiples",
                    {.min = 1, .max = 16}) {
        sections_.resize(static_cast<std::size_t>(harmonics));
        coefficients_.resize(sections_.size());
        hal::Retained(*this, {{"sections", sections_},
                              {"coefficients", coefficients_},
                              {"f", f_},
                              {"w", w_},
                              {"d", d_},
                              {"used", used_},
                              {"running", running_}});
    }

    hal::Argument harmonics;
    hal::In<double> in{*this, "in", "input"};
    hal::Out<double> out{*this, "out", "filtered input", {.finite = true}};
    hal::In<bool> enable{*this, "enable", "FALSE copies in to out", {.initial = true}};
    hal::In<double> frequency{*this,
                              "frequency",
                              "frequency to remove; may follow a speed",
                              {.initial = 50.0, .unit = "Hz"}};
    hal::In<double> width{*this,
                          "width",
                          "bandwidth between the two frequencies that are 3 dB down",
                          {.initial = 5.0, .unit = "Hz"}};
    hal::In<double> depth{*this, "depth",
                          "gain at the centre: 0 removes the frequency, 1 passes it"};
    hal::Out<std::uint32_t> active{
        *this, "active", "number of active notches: those below 0.45 of the thread's rate"};
    hal::Out<std::uint32_t> bad_inputs{*this, "bad-inputs",
                                       "number of NaN or infinite inputs; out keeps its value"};
    hal::Function run{*this, "", &Notch::update, "filters"};

    void update(hal::Cycle cycle) noexcept {
        const double now = in;
        const double f = std::fabs(frequency * cycle.seconds());

        const double w = width * cycle.seconds();
        const double d = depth;
        if (f != f_ || w != w_ || d != d_) {
            design(f, w, d);
        }
        if (!std::isfinite(now)) {
            bad_inputs = bad_inputs + 1;
            return;
        }
        const std::size_t count = enable ? used_ : 0;
        double y = now;
        for (std::size_t i = 0; i < count; ++i) {
            if (i >= running_) {
                sections_[i].settle(coefficients_[i], y);
            }
            y = sections_[i].step(coefficients_[i], y);
        }
        running_ = std::isfinite(y) ? count : 0;
        out = std::isfinite(y) ? y : now;
        active = static_cast<std::uint32_t>(count);
    }

private:
    void design(double f, double w, double d) noexcept {
        f_ = f;
        w_ = w;
        d_ = d;
        used_ = 0;
        if (!(w > 0.0 && w < 1.0 && d >= 0.0 && d <= 1.0 && f > 1e-9)) return;
        while (used_ < sections_.size() && f * static_cast<double>(used_ + 1) < 0.45) {
            const double centre = f * static_cast<double>(used_ + 1);
            coefficients_[used_++] = section(Shape::notch, centre, centre / w, d);
        }
    }

    std::vector<Section> sections_;
    std::vector<Coefficients> coefficients_;
    double f_ = -1.0;
    double w_ = 0.0;
    double d_ = 0.0;
    std::size_t used_ = 0;
    std::size_t running_ = 0;
};

}  // namespace

HAL_COMPONENT(Notch, "notch", "Removes a variable frequency and its multiples from a signal", R"(
A notch of `width` Hz around `frequency` and, with `harmonics`, around its multiples: mains hum in a
force sensor, the teeth of a gear, a spindle's imbalance. Link `frequency` to the speed (in turns
per second) and the notches follow it in every cycle. A notch above 0.45 of the thread's rate, or
with an invalid width or depth, is disabled; `active` is the number of active ones.

    loadrt notch names=no-hum harmonics=3
    addf no-hum servo
    setp no-hum.frequency 50
    net force-raw => no-hum.in
    net force     <= no-hum.out
)")
