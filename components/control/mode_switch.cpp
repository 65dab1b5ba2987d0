// SPDX-License-Identifier: MIT
#include "hal/component.hpp"
#include "hal/retained.hpp"

namespace {

enum Transition : std::uint32_t { jump = 0, fade = 1, decay = 2, slew = 3, keep_offset = 4 };

struct ModeSwitch : hal::Component {
    using Component::Component;

    hal::Argument inputs{*this, "inputs", 3, "how many sources", {.min = 1, .max = 256}};
    hal::In<std::uint32_t> select{*this, "select", "number of the source for out, from 0"};
    hal::Ins<double> in{*this, "in-##", inputs, "source ##"};
    hal::In<std::uint32_t> transition{*this,
                                      "transition",
                                      "0 jump; 1 fade; 2 decay; 3 slew; 4 keep the offset",
                                      {.initial = fade}};
    hal::In<double> time{*this,
                         "time",
                         "duration of a fade; time constant of a decay",
                         {.initial = 0.1, .unit = "s"}};
    hal::In<double> rate{
        *this, "rate", "rate of change of the offset in a slew", {.initial = 1.0, .unit = "1/s"}};
    hal::In<bool> hold{*this, "hold",
                       "TRUE holds out; FALSE returns to the source with a transition"};
    hal::In<bool> clear{*this, "clear", "TRUE sets the offset to 0 immediately"};
    hal::Out<double> out{
        *this, "out", "selected source plus the remaining offset", {.finite = true}};
    hal::Out<double> offset{*this, "offset", "out - source", {.finite = true}};
    hal::Out<std::uint32_t> selected{*this, "selected", "number of the source in use"};
    hal::Out<bool> switching{*this, "switching", "TRUE during a transition"};
    hal::Out<bool> bad_source{*this, "source-error",
                              "TRUE: select is out of range, or the source is NaN or infinite"};
    hal::Outs<bool> active{*this, "active-##", inputs, "TRUE: source ## is in use"};
    hal::Function run{*this, "", &ModeSwitch::update, "passes the selected source"};

    void update(hal::Cycle cycle) noexcept {
        const bool known = select < in.size();
        const std::size_t wanted = known ? static_cast<std::size_t>(select) : source_;
        const double value = in[wanted];
        const bool usable = std::fabs(value) <= 1e300;
        const bool changes = wanted != source_ || was_held_;
        if (usable && !hold) {
            if (!started_) {
                offset_ = 0.0;
            } else if (changes) {
                begin(out_ - value);
            } else {
                if (transition != begun_) {
                    begin(offset_);
                }
                approach(cycle.seconds());
            }
            if (clear) {
                offset_ = 0.0;
            }
            source_ = wanted;
            out_ = value + offset_;
        }
        started_ = true;
        was_held_ = hold || !usable;  // taken up again like another source
        bad_source = !known || !usable;
        out = out_;
        offset = offset_;
        selected = static_cast<std::uint32_t>(source_);
        switching = offset_ != 0.0;
        for (std::size_t i = 0; i < active.size(); ++i) {
            active[i] = i == source_;
        }
    }

private:
    void begin(double gap) noexcept {
        offset_ = first_ =
            std::isfinite(gap) && transition != jump && transition <= keep_offset ? gap : 0.0;
        share_ = 0.0;
        begun_ = transition;
    }
    void approach(double dt) noexcept {
        switch (transition) {
        case fade:
            share_ += time > 0.0 ? dt / time : 1.0;
            offset_ = share_ < 1 - 1e-9 ? first_ * weight(share_) : 0.0;
            break;
        case decay:
            offset_ *= time > 0.0 ? std::exp(-dt / time) : 0.0;
            if (!(std::fabs(offset_) > 1e-9 * std::fabs(first_))) {
                offset_ = 0.0;
            }
            break;
        case slew: {
            const double step = rate > 0.0 ? rate * dt : 0.0;
            offset_ = std::fabs(offset_) <= step ? 0.0 : offset_ - std::copysign(step, offset_);
            break;
        }
        case keep_offset: break;
        default: offset_ = 0.0;
        }
        if (!std::isfinite(offset_)) {
            offset_ = 0.0;
        }
    }
    /// From 1 to 0 with a slope of 0 at both ends: out leaves the old value and meets the new one
    /// smoothly.
    static double weight(double share) noexcept { return 1 - share * share * (3 - 2 * share); }

    double out_ = 0.0;
    double offset_ = 0.0;
    double first_ = 0.0;
    double share_ = 0.0;                // of a fade that is over
    std::uint32_t begun_ = jump;        // the transition that first_ is of
    std::size_t source_ = 0;
    bool started_ = false;
    bool was_held_ = false;
    hal::Retained retained_{*this,
                            {{"out", out_},
                             {"offset", offset_},
                             {"first", first_},
                             {"share", share_},
                             {"begun", begun_},
                             {"source", source_},
                             {"started", started_},
                             {"was-held", was_held_}}};
};

}  // namespace

HAL_COMPONENT(ModeSwitch, "mode_switch", "Switches between sources without a jump", R"(
    out = source + offset,   offset = previous out - new source at the moment of switching, then towards 0

| transition | offset |
| --- | --- |
| 0 jump | 0 |
| 1 fade | times 1 - 3 s^2 + 2 s^3, s from 0 to 1 in `time`: smooth at both ends |
| 2 decay | exponentially with the time constant `time` |
| 3 slew | by `rate` |
| 4 keep | constant until the next switch or `clear` (a jog that continues from the program's position) |

This is the bumpless transfer of process control (K. Astroem, T. Haegglund, *Advanced PID Control*,
ISA 2006). `out` follows the motion of the new source immediately; only the gap fades. If a source
can track (an integrator, a trajectory), load it with `out` while its `active-##` is FALSE; then
there is no gap.

While `select` is out of range, the last source remains in use. While the source is NaN or infinite,
`out` keeps its value; the return to the source is a transition, as it is after `hold`. A source
that is used in the first cycle is used without a transition. A `transition` above 4 is a jump. A
`time`, `rate` or `transition` that changes meanwhile applies to the offset that is left.

    loadrt mode_switch names=effort-source inputs=2
    addf effort-source servo
    setp effort-source.time 0.2
    net balancing   => effort-source.select
    net swing-up    => effort-source.in-00
    net balance     => effort-source.in-01
    net effort      <= effort-source.out
)")
