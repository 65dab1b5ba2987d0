// SPDX-License-Identifier: MIT
#include <memory>

#include "hal/component.hpp"

namespace {

struct Delay : hal::Component {
    using Component::Component;
    hal::Argument          depth{*this, "depth", 1000, "the longest delay in cycles", {.min = 1, .max = 10'000'000}};
    hal::In<double>        in{*this, "in", "the value"};
    hal::In<bool>          bit_in{*this, "bit-in", "a bit that goes beside it"};
    hal::In<std::uint32_t> cycles{*this, "cycles", "how many cycles later"};
    hal::In<double>        seconds{*this, "seconds", "how much later, on top of cycles", {.unit = "s"}};
    hal::In<bool>          interpolate{*this, "interpolate", "TRUE: between two cycles on the straight line; FALSE: the nearest cycle"};
    hal::In<bool>          reset{*this, "reset", "while TRUE the inputs are passed and fill the line"};
    hal::Out<double>       out{*this, "out", "in, later"};
    hal::Out<bool>         bit_out{*this, "bit-out", "bit-in, later"};
    hal::Out<double>       delayed{*this, "delay", "how much later out is", {.unit = "s", .finite = true}};
    hal::Out<bool>         limited{*this, "limited", "TRUE: more than depth is wanted, or less than nothing"};
    hal::Function          run{*this, "", hal::step<&Delay::update>, "stores in, gives out"};

    void update(hal::Cycle cycle) noexcept {
        const double most = static_cast<double>(size_ - 1);
        const double wanted = static_cast<double>(cycles) + seconds / cycle.seconds();
        const bool possible = wanted >= -1e-9 && wanted <= most + 1e-9;
        double back = wanted >= most ? most : wanted > 0.0 ? wanted : 0.0;  // 0 for what is not a number
        // Seconds that are meant to be whole periods must not fall short of one by rounding.
        const double whole = std::round(back);
        if (!interpolate || std::fabs(back - whole) < 1e-6) back = whole;

        newest_ = (newest_ + 1) % size_;
        line_[newest_] = {in, bit_in};
        if (reset) filled_ = 0;
        if (filled_ < size_) ++filled_;
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
    /// What came `n` cycles ago; before the first, the first.
    const Sample& at(std::size_t n) const noexcept { return line_[(newest_ + size_ - std::min(n, filled_ - 1)) % size_]; }

    std::size_t size_ = static_cast<std::size_t>(depth) + 1, newest_ = 0, filled_ = 0;
    std::unique_ptr<Sample[]> line_ = std::make_unique<Sample[]>(size_);
};

}  // namespace

HAL_COMPONENT(Delay, "delay", "Gives a value and a bit back some cycles or seconds later", R"(
    out(t) = in(t - cycles * period - seconds)

A dead time: of a bus, a camera, a conveyor. The memory is taken when the component is loaded: `depth` cycles, 16 bytes each. The delay
may change at any time; when it grows, values come twice, when it shrinks, some are left out. A delay of a part of a period is the nearest
cycle, or with `interpolate` lies on the straight line between its neighbours (a value that is not a number then spoils both).

Before the first value is old enough `out` is the first value; `reset` starts like that again. A delay beyond `depth` is `depth`, a
negative one or what is not a number is 0, and `limited` says so.

    loadrt delay names=camera-lag depth=100
    addf camera-lag servo
    setp camera-lag.seconds 0.04
    net seen-now   => camera-lag.in
    net seen-later <= camera-lag.out
)")
