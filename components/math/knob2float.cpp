// SPDX-License-Identifier: MIT
#include "hal/component.hpp"
#include "hal/limit.hpp"
#include "hal/retained.hpp"

namespace {

struct Knob2float : hal::Component {
    using Component::Component;
    hal::In<std::int32_t> counts{*this, "counts", "position of the knob, usually encoder counts"};
    hal::In<bool> enable{*this, "enable", "TRUE: the knob changes out; FALSE holds out"};
    hal::In<double> scale{*this, "scale", "change of out per count"};
    hal::Out<double> out{*this, "out", "value"};
    hal::LimitParam max_out{
        *this, "max-out", "largest value; counts beyond it are lost", {.initial = 1.0}};
    hal::CorrectedLimitParam min_out{
        *this, "min-out", "smallest value; counts beyond it are lost", {.initial = 0.0}};
    hal::Function run{*this, "", hal::step<&Knob2float::update>, "follows the knob"};

    void update(hal::Cycle) noexcept {
        if (min_out > max_out) {
            min_out.correct(max_out);
        }
        const std::int32_t now = counts;
        // the counter may wrap around
        const auto moved = static_cast<std::int32_t>(static_cast<std::uint32_t>(now) -
                                                     static_cast<std::uint32_t>(last_));
        last_ = now;
        const double next = std::fmin(std::fmax(value_ + moved * scale.get(), min_out), max_out);
        if (enable && std::isfinite(next)) {
            value_ = next;
        }
        out = value_;
    }

private:
    double value_ = 0.0;
    std::int32_t last_ = 0;
    hal::Retained retained_{*this, {{"value", value_}, {"last", last_}}};
};

}  // namespace

HAL_COMPONENT(Knob2float, "knob2float", "Turns the counts of a knob into a number within limits",
              R"(
While `enable` is TRUE each count changes `out` by `scale`, between `min-out` and `max-out`; turning
back from a limit takes effect immediately. Counts while `enable` is FALSE are ignored. A `min-out`
above `max-out` is set to it. A counter that wraps around goes on (LinuxCNC: `out` jumps by 2^32
counts).

    loadrt knob2float names=feed
    addf feed servo
    setp feed.scale 0.01
    setp feed.max-out 1.2
    net knob-counts   => feed.counts
    net panel-active  => feed.enable
    net feed-override <= feed.out
)")
