// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "hal/component.hpp"

namespace {

/// Values of pin `reason`. Published: never renumber.
enum Reason : std::uint32_t { agree = 0, differ = 1, values_differ = 2, bits_differ = 3, no_number = 4, bad_parameter = 5, not_reset = 6 };

enum Choice : std::uint32_t { channel_a = 0, mean = 1, lower = 2, higher = 3, nearer_0 = 4 };

struct DualChannel : hal::Component {
    using Component::Component;

    hal::In<double> a{*this, "a", "a value, from channel A"};
    hal::In<double> b{*this, "b", "the same value, from channel B"};
    hal::In<bool> bit_a{*this, "bit-a", "a bit, from channel A"};
    hal::In<bool> bit_b{*this, "bit-b", "the same bit, from channel B"};
    hal::In<bool> reset{*this, "reset", "a rising edge ends a fault once the channels agree"};

    hal::Param<double> tolerance{*this, "tolerance", "by which the values may differ"};
    hal::Param<double> relative{*this, "relative-tolerance", "and by this share of the larger of both"};
    hal::Param<double> time{*this, "discrepancy-time", "how long they may differ by more", {.unit = "s"}};
    hal::Param<double> scale_b{*this, "scale-b", "b is multiplied by this", {.initial = 1.0}};
    hal::Param<double> offset_b{*this, "offset-b", "and then this is added"};
    hal::Param<bool> antivalent{*this, "antivalent", "TRUE: bit-b is the inverse"};
    hal::Param<bool> latch{*this, "latch", "TRUE: a fault stays until reset; FALSE: until they agree", {.initial = true}};
    hal::Param<std::uint32_t> choice{*this, "choice",
                                     "out: 0 a; 1 mean; 2 the smaller; 3 the larger; 4 the one nearer to 0", {.initial = mean}};
    hal::Param<double> substitute{*this, "substitute", "out while ok is FALSE, with use-substitute"};
    hal::Param<bool> use_substitute{*this, "use-substitute", "TRUE: out is substitute while ok is FALSE; FALSE: the last good value"};

    hal::Out<bool> ok{*this, "ok", "TRUE: both channels say the same", {.safe = false}};
    hal::Out<bool> fault{*this, "fault", "TRUE: they have differed for too long"};
    hal::Out<bool> differs{*this, "differs", "TRUE: they differ in this cycle"};
    hal::Out<std::uint32_t> reason{*this, "reason", "why ok is FALSE: see the table", {.initial = not_reset}};
    hal::Out<double> out{*this, "out", "the value", {.finite = true}};
    hal::Out<bool> bit_out{*this, "bit-out", "TRUE: both bits say so, and ok", {.safe = false}};
    hal::Out<double> difference{*this, "difference", "a - b", {.finite = true}};
    hal::Out<double> largest{*this, "largest-difference", "of all since the last reset", {.finite = true}};
    hal::Out<double> since{*this, "differs-for", "how long they have differed", {.unit = "s", .finite = true}};

    hal::Function run{*this, "", &DualChannel::update, "compares the channels"};

    void update(hal::Cycle cycle) noexcept {
        const bool pressed = reset && !was_reset_;
        was_reset_ = reset;
        if (latch && fault_ == agree && !ok && was_ok_) fault_ = not_reset;  // the host wrote the safe value

        const double second = b * scale_b + offset_b, apart = a - second;
        const bool numbers = std::isfinite(apart) && std::isfinite(a + second);
        const bool sound = tolerance >= 0.0 && relative >= 0.0 && time >= 0.0 && std::isfinite(scale_b + offset_b) && choice <= nearer_0;
        const double allowed = tolerance + relative * std::max(std::fabs(a), std::fabs(second));
        const bool first_bit = bit_a, second_bit = bit_b != antivalent;
        std::uint32_t found = agree;
        if (!sound) found = bad_parameter;
        else if (!numbers) found = no_number;
        else if (std::fabs(apart) > allowed * (1 + 1e-15)) found = values_differ;
        else if (first_bit != second_bit) found = bits_differ;

        for_ = found == agree ? 0.0 : std::min(for_ + cycle.seconds(), 1e9);
        const bool late = for_ > time + cycle.seconds() * 1e-6 || time == 0.0;
        if (found == agree) {
            if (pressed || !latch) fault_ = agree;
        } else if ((late || found >= no_number) && fault_ == agree) {
            fault_ = found;
        }
        if (pressed) largest_ = 0.0;
        if (numbers) largest_ = std::max(largest_, std::fabs(apart));

        // Within the discrepancy time the value goes on as it was, the bit is FALSE when one of them is.
        if (found == agree) good_ = chosen(second);
        const bool well = fault_ == agree;
        was_ok_ = well;
        ok = well;
        fault = !well;
        differs = found != agree;
        reason = !well ? fault_ : found == agree ? std::uint32_t{agree} : std::uint32_t{differ};
        out = well || !use_substitute || !std::isfinite(substitute) ? good_ : substitute.get();
        bit_out = well && first_bit && second_bit;
        difference = numbers ? apart : 0.0;
        largest = largest_;
        since = for_;
    }

private:
    double chosen(double second) const noexcept {
        switch (choice) {
            case channel_a: return a;
            case lower: return std::min(a.get(), second);
            case higher: return std::max(a.get(), second);
            case nearer_0: return std::fabs(a) <= std::fabs(second) ? a.get() : second;
            default: return a / 2 + second / 2;
        }
    }
    double for_ = 0.0, good_ = 0.0, largest_ = 0.0;
    std::uint32_t fault_ = agree;
    bool was_reset_ = false, was_ok_ = false;
};

}  // namespace

HAL_COMPONENT(DualChannel, "dual_channel", "Compares two channels of a value and of a bit", R"(
    b'      = b * scale-b + offset-b
    differs = |a - b'| > tolerance + relative-tolerance * max(|a|, |b'|)   or the bits differ

Two encoders, two force sensors, the command and its echo: what one of them says is believed only while the other agrees (the comparison
of category 3 of ISO 13849-1). They may differ for `discrepancy-time`; meanwhile `out` keeps its value and `bit-out` is FALSE unless both
bits are TRUE. Longer is a `fault`; it stays until a rising edge of `reset` while they agree, or without `latch` until they agree. A value
that is not a number and a parameter that makes no sense are faults at once. After a stop or a fault of the runtime a reset is needed,
too. Leave the pair that is not used unlinked. Software on one computer compares, but is no second channel itself.

| reason | |
| --- | --- |
| 0 | they agree |
| 1 | they differ, not yet for too long |
| 2, 3 | fault: the values, the bits differed for too long |
| 4 | fault: a value is not a number |
| 5 | fault: a parameter is negative or not a number, or choice is above 4 |
| 6 | waiting for the reset after a stop of the runtime |

    loadrt dual_channel names=x-position
    addf x-position servo
    setp x-position.tolerance 0.05
    setp x-position.discrepancy-time 0.02
    net x-motor-encoder => x-position.a
    net x-scale         => x-position.b
    net x-position-ok   <= x-position.ok
)")
