// SPDX-License-Identifier: MIT
#include <memory>

#include "hal/component.hpp"
#include "hal/retained.hpp"

namespace {

struct Delay : hal::Component {
    using Component::Component;
    hal::Argument depth{
        *this, "depth", 1000, "maximum delay in cycles", {.min = 1, .max = 10'000'000}};
    hal::In<double> in{*this, "in", "value"};
    hal::In<bool> bit_in{*this, "bit-in", "bit to delay with the value"};
    hal::In<std::uint32_t> cycles{*this, "cycles", "delay in cycles"};
    hal::In<double> seconds{*this, "seconds", "delay added to cycles", {.unit = "s"}};
    hal::In<bool> interpolate{
        *this, "interpolate",
        "TRUE interpolates linearly between two cycles; FALSE takes the nearest cycle"};
    hal::In<bool> reset{*this, "reset", "TRUE passes the inputs and fills the memory with them"};
    hal::Out<double> out{*this, "out", "in, delayed"};
    hal::Out<bool> bit_out{*this, "bit-out", "bit-in, delayed"};
    hal::Out<double> delayed{*this, "delay", "delay in use", {.unit = "s", .finite = true}};
    hal::Out<bool> limited{*this, "limited",
                           "TRUE: the requested delay is above depth or negative"};
    hal::Function run{*this, "", hal::step<&Delay::update>, "stores in and updates out"};

    void update(hal::Cycle cycle) noexcept {
        const double max = static_cast<double>(size_ - 1);
        const double wanted = static_cast<double>(cycles) + seconds / cycle.seconds();
        const bool possible = wanted >= -1e-9 && wanted <= max + 1e-9;
        double back = 0.0;  // also for NaN
        if (wanted > 0.0) {
            back = std::min(wanted, max);
        }
        // Seconds that are a multiple of the period must not round down to one period less.
        const double whole = std::round(back);
        if (!interpolate || std::fabs(back - whole) < 1e-6) {
            back = whole;
        }

        newest_ = (newest_ + 1) % size_;
        line_[newest_] = {in, bit_in};
        if (reset) {
            filled_ = 0;
        }
        if (filled_ < size_) {
            ++filled_;
        }
        const auto n = static_cast<std::size_t>(back);
        const double share = back - static_cast<double>(n);
        const Sample& later = at(n);
        bit_out = at(static_cast<std::size_t>(whole)).bit;
        out = share > 0.0 ? later.value + share * (at(n + 1).value - later.value) : later.value;
        delayed = back * cycle.seconds();
        limited = !possible;
    }

private:
    struct Sample {
        double value;
        bool bit;
    };
    /// Returns the input `n` cycles ago; before the first, the first.
    const Sample& at(std::size_t n) const noexcept {
        return line_[(newest_ + size_ - std::min(n, filled_ - 1)) % size_];
    }

    std::size_t size_ = static_cast<std::size_t>(depth) + 1;
    std::size_t newest_ = 0;
    std::size_t filled_ = 0;
    std::unique_ptr<Sample[]> line_ = std::make_unique<Sample[]>(size_);
    hal::Retained retained_{
        *this, {{"newest", newest_}, {"filled", filled_}, {"line", line_.get(), size_}}};
};

}  // namespace

HAL_COMPONENT(Delay, "delay", "Delays a value and a bit by cycles or seconds", R"(
    out(t) = in(t - cycles * period - seconds)

A dead time, as of a bus, a camera or a conveyor. The memory is allocated when the component is
loaded: `depth` cycles, 16 bytes each. The delay may change at any time: when it grows, values are
repeated; when it shrinks, values are skipped. A delay that is not a multiple of the period is
rounded to the nearest cycle, or with `interpolate` interpolated linearly between its neighbours (a
NaN then affects both intervals).

Until the first value is old enough, `out` is the first value; `reset` restarts this. A delay above
`depth` counts as `depth`, a negative or NaN delay as 0; `limited` is TRUE then.

    loadrt delay names=camera-lag depth=100
    addf camera-lag servo
    setp camera-lag.seconds 0.04
    net seen-now   => camera-lag.in
    net seen-later <= camera-lag.out
)")
