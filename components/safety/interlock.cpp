// SPDX-License-Identifier: MIT
#include <algorithm>
#include <bit>
#include <cstdint>

#include "hal/component.hpp"
#include "hal/edge.hpp"
#include "hal/limit.hpp"
#include "hal/retained.hpp"

namespace {

struct Interlock : hal::Component {
    using Component::Component;

    hal::Argument inputs{*this, "inputs", 8, "number of conditions", {.min = 1, .max = 64}};
    hal::Ins<bool> in{*this, "in-##", inputs, "condition ##: TRUE is good"};
    hal::Ins<double> delay{*this,
                           "delay-##",
                           inputs,
                           "time for which condition ## must be bad before it trips",
                           {.unit = "s"}};
    hal::In<std::uint64_t> use{
        *this, "use-mask", "bit n: condition n is monitored", {.initial = ~std::uint64_t{0}}};
    hal::In<std::uint64_t> invert{*this, "invert-mask", "bit n: condition n is good when FALSE"};
    hal::In<std::uint64_t> latch{*this,
                                 "latch-mask",
                                 "bit n: condition n is latched until reset",
                                 {.initial = ~std::uint64_t{0}}};
    hal::In<std::uint64_t> warn{*this, "warn-mask", "bit n: condition n only warns"};
    hal::In<std::uint64_t> bypass{*this, "bypass-mask",
                                  "bit n: condition n is bypassed while bypass-enable is TRUE"};
    hal::In<bool> bypass_enable{*this, "bypass-enable", "TRUE enables the bypass (key switch)"};
    hal::OptionalLimit bypass_time{*this,
                                   "bypass-time",
                                   "maximum duration of a bypass; 0: no limit; negative: no bypass",
                                   {.unit = "s"}};
    hal::In<bool> acknowledge{*this, "acknowledge",
                              "a rising edge turns off the horn and stops the flashing"};
    hal::In<bool> reset{*this, "reset",
                        "a rising edge clears latched conditions that are good again"};
    hal::In<bool> start_needs_reset{*this,
                                    "start-needs-reset",
                                    "TRUE: ok also requires a reset after the start",
                                    {.initial = true}};

    hal::Out<bool> ok{*this, "ok", "TRUE: all monitored conditions are good", {.safe = false}};
    hal::Out<bool> ready{*this, "ready-to-reset", "TRUE: a reset would set ok"};
    hal::Out<bool> warning{*this, "warning", "TRUE: a condition in warn-mask is bad"};
    hal::Out<bool> bypassed{*this, "bypassed", "TRUE: a monitored condition is bypassed"};
    hal::Out<bool> horn{*this, "horn", "TRUE: a further condition has tripped; until acknowledge"};
    hal::Out<std::int32_t> first{
        *this, "first", "number of the condition that cleared ok first; -1: none", {.initial = -1}};
    hal::Out<std::uint64_t> first_mask{*this, "first-mask",
                                       "bits of all conditions that tripped in that cycle"};
    hal::Out<std::uint64_t> bad{*this, "bad-mask", "bits of the conditions that are bad"};
    hal::Out<std::uint64_t> tripped{*this, "tripped-mask",
                                    "bits of the conditions that are bad or latched"};
    hal::Out<double> since{
        *this, "since", "time for which ok has been FALSE", {.unit = "s", .finite = true}};
    hal::Out<std::uint32_t> trips{*this, "trips", "number of times ok became FALSE"};
    hal::Outs<bool> lamp{*this, "lamp-##", inputs, "lamp of condition ##: see the table"};

    hal::Function run{*this, "", &Interlock::update, "evaluates the conditions"};

    /// Evaluates the inputs: which have tripped, whether ok may be TRUE, and which was the first.
    void update(hal::Cycle cycle) noexcept {
        const bool pressed = reset_edge_.rises(reset);
        const bool heard = acknowledge_edge_.rises(acknowledge);
        const double dt = cycle.seconds();
        phase_ns_ = (phase_ns_ + cycle.period_ns()) % second_ns;
        const std::uint64_t watched = use & everything();

        const std::uint64_t skipped = may_bypass(dt) ? bypass & watched : 0;
        const std::uint64_t now = look(watched & ~skipped, dt);
        const std::uint64_t fresh = now & ~tripped_;
        const std::uint64_t stops = ~warn.get();
        tripped_ = (tripped_ & latch & watched & ~skipped) | now;
        if (pressed) {
            tripped_ = now;
        }
        unheard_ = (unheard_ | fresh) & tripped_;
        if (heard) {
            unheard_ = 0;
        }

        const std::uint64_t stopping = tripped_ & stops;
        update_wait(pressed && stopping == 0);
        const bool healthy = stopping == 0 && !waits_;
        count_trip(healthy, dt);
        if (stopping == 0) {
            first_ = 0;
        } else if (first_ == 0) {
            first_ = (fresh & stops) != 0 ? fresh & stops : stopping;
        }
        was_ok_ = healthy;
        show(healthy, now, stops, skipped != 0);
    }

private:
    /// Returns whether the key switch is on, and its time is not over.
    bool may_bypass(double dt) noexcept {
        const double longest = bypass_time;  // read in each cycle: its last valid value may apply
        bypass_for_ = bypass_enable ? std::min(bypass_for_ + dt, 1e9) : 0.0;
        return bypass_enable && (longest == 0.0 || bypass_for_ <= longest);
    }
    /// ok waits for a reset at the start, and after a stop of the runtime, which wrote the safe
    /// value.
    void update_wait(bool is_reset) noexcept {
        if (!has_run_ ? start_needs_reset.get() : was_ok_ && !ok) {
            waits_ = true;
        }
        has_run_ = true;
        if (is_reset) {
            waits_ = false;
        }
    }
    /// Counts the ends of ok, and the time since.
    void count_trip(bool healthy, double dt) noexcept {
        if (was_ok_ && !healthy) {
            trips = trips + 1;
            since_ = 0.0;
        } else if (!healthy) {
            since_ = std::min(since_ + dt, 1e9);
        }
    }

    static constexpr std::int64_t second_ns = 1'000'000'000;
    std::uint64_t everything() const noexcept {
        return in.size() >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << in.size()) - 1;
    }

    /// The conditions among `watched` that are bad for as long as they have to be.
    std::uint64_t look(std::uint64_t watched, double dt) noexcept {
        std::uint64_t found = 0;
        for (std::size_t i = 0; i < in.size(); ++i) {
            const std::uint64_t bit = std::uint64_t{1} << i;
            const bool healthy = in[i] != ((invert & bit) != 0);
            if (healthy || (watched & bit) == 0) {
                bad_for_[i] = 0.0;
            } else if (!(delay[i] > 0.0) ||
                       (bad_for_[i] = std::min(bad_for_[i] + dt, 1e9)) > delay[i] + dt * 1e-6) {
                found |= bit;
            }
        }
        return found;
    }

    void show(bool healthy, std::uint64_t now, std::uint64_t stops, bool skipping) noexcept {
        ok = healthy;
        ready = !healthy && (now & stops) == 0;
        warning = (tripped_ & ~stops) != 0;
        bypassed = skipping;
        horn = unheard_ != 0;
        first = first_ != 0 ? std::countr_zero(first_) : -1;
        first_mask = first_;
        bad = now;
        tripped = tripped_;
        since = healthy ? 0.0 : since_;
        const bool fast = phase_ns_ % (second_ns / 4) < second_ns / 8;

        const bool slow = phase_ns_ < second_ns / 2;
        for (std::size_t i = 0; i < lamp.size(); ++i) {
            const std::uint64_t bit = std::uint64_t{1} << i;
            const bool flashing = (unheard_ & bit) != 0;
            const bool is_first = (first_ & bit) != 0;
            if (is_first && flashing) {
                lamp[i] = fast;
            } else if (is_first || flashing) {
                lamp[i] = slow;
            } else {
                lamp[i] = (tripped_ & bit) != 0;
            }
        }
    }

    double bad_for_[64] = {}, since_ = 0.0, bypass_for_ = 0.0;
    std::uint64_t tripped_ = 0;
    std::uint64_t unheard_ = 0;
    std::uint64_t first_ = 0;
    std::int64_t phase_ns_ = 0;
    hal::RisingEdge reset_edge_{true};  // TRUE from the first cycle on: not a rising edge
    hal::RisingEdge acknowledge_edge_;
    bool was_ok_ = false;
    bool waits_ = false;

    bool has_run_ = false;
    hal::Retained retained_{*this,
                            {{"bad-for", bad_for_},
                             {"since", since_},
                             {"bypass-for", bypass_for_},
                             {"tripped", tripped_},
                             {"unheard", unheard_},
                             {"first", first_},
                             {"phase-ns", phase_ns_},
                             {"was-reset", reset_edge_},
                             {"was-acknowledged", acknowledge_edge_},
                             {"was-ok", was_ok_},
                             {"waits", waits_},
                             {"has-run", has_run_}}};
};

}  // namespace

HAL_COMPONENT(Interlock, "interlock",
              "Interlock of up to 64 conditions with first-out annunciation", R"(
`ok` is TRUE while every monitored condition is good. When it becomes FALSE, `first` is the number
of the condition that tripped first, regardless of later ones: the first-out sequence of ISA-18.1.
Masks have a bit per condition (bit 0 is `in-00`) and may be written in hexadecimal, as in 0x11.

| mask | bit n set |
| --- | --- |
| use-mask | condition n is monitored |
| invert-mask | it is good when FALSE |
| latch-mask | once bad it is latched until a rising edge of `reset` |
| warn-mask | it affects `warning` only, not `ok` |
| bypass-mask | it is not monitored while `bypass-enable` is TRUE (for at most `bypass-time`; never if it is negative) |

| lamp-## | |
| --- | --- |
| off | good |
| flashing at 4 Hz | first condition, not acknowledged |
| flashing at 1 Hz | first condition, acknowledged; or another one, not acknowledged |
| on | bad or latched, acknowledged, not the first one |

`delay-##` filters a flickering condition. `acknowledge` turns off `horn`; `reset` clears conditions
that are good again. With `start-needs-reset` a reset is required after the start; after a stop or a
fault of the runtime it is always required. This is software on one computer, not a certified safety
function.

    loadrt interlock names=spindle-may-run inputs=4
    addf spindle-may-run servo
    setp spindle-may-run.invert-mask 0x4
    setp spindle-may-run.delay-01 0.5
    net door-closed   => spindle-may-run.in-00
    net oil-pressure  => spindle-may-run.in-01
    net overheated    => spindle-may-run.in-02
    net tool-clamped  => spindle-may-run.in-03
    net spindle-ok    <= spindle-may-run.ok
)")
