// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "hal/component.hpp"
#include "hal/edge.hpp"
#include "hal/retained.hpp"

namespace {

/// Values of the public pin `reason`: never renumber them.
enum Reason : std::uint32_t {
    agree = 0,
    differ = 1,
    values_differ = 2,
    bits_differ = 3,
    no_number = 4,
    bad_parameter = 5,
    not_reset = 6
};

enum Choice : std::uint32_t { channel_a = 0, mean = 1, lower = 2, higher = 3, nearer_0 = 4 };

struct DualChannel : hal::Component {
    using Component::Component;

    hal::In<double> a{*this, "a", "value of channel A"};
    hal::In<double> b{*this, "b", "value of channel B"};
    hal::In<bool> bit_a{*this, "bit-a", "bit of channel A"};
    hal::In<bool> bit_b{*this, "bit-b", "bit of channel B"};
    hal::In<bool> reset{*this, "reset", "a rising edge clears a fault once the channels agree"};

    hal::Param<double> tolerance{*this, "tolerance", "permitted difference of the values"};
    hal::Param<double> relative{
        *this, "relative-tolerance",
        "additional permitted difference as a fraction of the larger value"};
    hal::Param<double> time{
        *this, "discrepancy-time", "time for which the channels may differ by more", {.unit = "s"}};
    hal::Param<double> scale_b{*this, "scale-b", "scale of b", {.initial = 1.0}};
    hal::Param<double> offset_b{*this, "offset-b", "offset added to b after scaling"};
    hal::Param<bool> antivalent{*this, "antivalent", "TRUE: bit-b is the inverse of bit-a"};
    hal::Param<bool> latch{*this,
                           "latch",
                           "TRUE: a fault remains until reset; FALSE: until the channels agree",
                           {.initial = true}};
    hal::Param<std::uint32_t> choice{
        *this,
        "choice",
        "value for out: 0 a; 1 mean; 2 smaller; 3 larger; 4 nearer to 0",
        {.initial = mean}};
    hal::Param<double> substitute{*this, "substitute",
                                  "value of out while ok is FALSE, with use-substitute"};
    hal::Param<bool> use_substitute{
        *this, "use-substitute",
        "TRUE: out is substitute while ok is FALSE; FALSE: the last valid value"};

    hal::Out<bool> ok{*this, "ok", "TRUE: both channels agree", {.safe = false}};
    hal::Out<bool> fault{*this, "fault",
                         "TRUE: the channels differed for longer than discrepancy-time"};
    hal::Out<bool> differs{*this, "differs", "TRUE: the channels differ in this cycle"};
    hal::Out<std::uint32_t> reason{
        *this, "reason", "reason why ok is FALSE: see the table", {.initial = not_reset}};
    hal::Out<double> out{*this, "out", "checked value", {.finite = true}};
    hal::Out<bool> bit_out{*this, "bit-out", "TRUE: both bits are TRUE, and ok", {.safe = false}};
    hal::Out<double> difference{*this, "difference", "a - b", {.finite = true}};
    hal::Out<double> max{
        *this, "largest-difference", "largest difference since the last reset", {.finite = true}};
    hal::Out<double> since{*this,
                           "differs-for",
                           "time for which the channels have differed",
                           {.unit = "s", .finite = true}};

    hal::Function run{*this, "", &DualChannel::update, "compares the channels"};

    void update(hal::Cycle cycle) noexcept {
        const bool reset_edge = reset_edge_.rises(reset);
        // the host wrote the safe value
        if (latch && fault_ == agree && !ok && was_ok_) {
            fault_ = not_reset;
        }
        const Comparison now = compare();
        count_time(now, cycle.seconds());
        update_fault(now, reset_edge, cycle.seconds());
        update_max(now, reset_edge);
        publish(now);
    }

private:
    /// The channels in one cycle.
    struct Comparison {
        double second = 0.0;      ///< b in the scale of a
        double difference = 0.0;  ///< a - second
        bool finite = false;
        bool bits = false;        ///< both bits are TRUE
        std::uint32_t found = agree;
        bool agrees() const noexcept { return found == agree; }
    };

    bool parameters_valid() const noexcept {
        return tolerance >= 0.0 && relative >= 0.0 && time >= 0.0 &&
               std::isfinite(scale_b + offset_b) && choice <= nearer_0;
    }

    Comparison compare() const noexcept {
        Comparison c;
        c.second = b * scale_b + offset_b;
        c.difference = a - c.second;
        c.finite = std::isfinite(c.difference) && std::isfinite(a + c.second);
        const bool first_bit = bit_a;
        const bool second_bit = bit_b != antivalent;
        c.bits = first_bit && second_bit;
        const double allowed = tolerance + relative * std::max(std::fabs(a), std::fabs(c.second));
        if (!parameters_valid()) {
            c.found = bad_parameter;
        } else if (!c.finite) {
            c.found = no_number;
        } else if (std::fabs(c.difference) > allowed * (1 + 1e-15)) {
            c.found = values_differ;
        } else if (first_bit != second_bit) {
            c.found = bits_differ;
        }
        return c;
    }

    void count_time(const Comparison& now, double period) noexcept {
        for_ = now.agrees() ? 0.0 : std::min(for_ + period, 1e9);
    }

    void update_fault(const Comparison& now, bool reset_edge, double period) noexcept {
        if (now.agrees()) {
            if (reset_edge || !latch) {
                fault_ = agree;
            }
            return;
        }
        if (fault_ != agree) return;
        const bool late = for_ > time + period * 1e-6 || time == 0.0;
        const bool immediate = now.found >= no_number;
        if (late || immediate) {
            fault_ = now.found;
        }
    }

    void update_max(const Comparison& now, bool reset_edge) noexcept {
        if (reset_edge) {
            max_ = 0.0;
        }
        if (now.finite) {
            max_ = std::max(max_, std::fabs(now.difference));
        }
    }

    std::uint32_t reason_of(const Comparison& now) const noexcept {
        if (fault_ != agree) return fault_;
        return now.agrees() ? agree : differ;
    }

    void publish(const Comparison& now) noexcept {
        // Within the discrepancy time the value is held, and the bit is FALSE if one of the two is.
        if (now.agrees()) {
            good_ = chosen(now.second);
        }
        const bool healthy = fault_ == agree;
        was_ok_ = healthy;
        ok = healthy;
        fault = !healthy;
        differs = !now.agrees();
        reason = reason_of(now);
        const bool substituted = !healthy && use_substitute && std::isfinite(substitute);
        out = substituted ? substitute.get() : good_;
        bit_out = healthy && now.bits;
        difference = now.finite ? now.difference : 0.0;
        max = max_;
        since = for_;
    }

    double chosen(double second) const noexcept {
        switch (choice) {
        case channel_a: return a;
        case lower: return std::min(a.get(), second);
        case higher: return std::max(a.get(), second);
        case nearer_0: return std::fabs(a) <= std::fabs(second) ? a.get() : second;
        default: return a / 2 + second / 2;
        }
    }

    double for_ = 0.0;
    double good_ = 0.0;
    double max_ = 0.0;
    std::uint32_t fault_ = agree;
    hal::RisingEdge reset_edge_{true};  // TRUE from the first cycle on: not a rising edge
    bool was_ok_ = false;
    hal::Retained retained_{*this,
                            {{"for", for_},
                             {"good", good_},
                             {"largest", max_},
                             {"fault", fault_},
                             {"was-reset", reset_edge_},
                             {"was-ok", was_ok_}}};
};

}  // namespace

HAL_COMPONENT(DualChannel, "dual_channel", "Compares two channels of a value and of a bit", R"(
    b'      = b * scale-b + offset-b
    differs = |a - b'| > tolerance + relative-tolerance * max(|a|, |b'|)   or the bits differ

For two encoders, two force sensors, or a command and its feedback: a value is valid only while both
channels agree (comparison as in category 3 of ISO 13849-1). They may differ for `discrepancy-time`;
meanwhile `out` keeps its value and `bit-out` is FALSE unless both bits are TRUE. A longer
difference is a `fault`; it remains until a rising edge of `reset` while the channels agree, or
without `latch` until they agree. A NaN value or an invalid parameter is an immediate fault. A stop
or a fault of the runtime requires a reset, too. Leave an unused pair unlinked. The comparison runs
as software on one computer and is not a second channel itself.

| reason | |
| --- | --- |
| 0 | the channels agree |
| 1 | they differ, within the discrepancy time |
| 2, 3 | fault: the values, the bits differed for longer than the discrepancy time |
| 4 | fault: a value is NaN or infinite |
| 5 | fault: a parameter is negative or NaN, or choice is above 4 |
| 6 | waiting for the reset after a stop of the runtime |

    loadrt dual_channel names=x-position
    addf x-position servo
    setp x-position.tolerance 0.05
    setp x-position.discrepancy-time 0.02
    net x-motor-encoder => x-position.a
    net x-scale         => x-position.b
    net x-position-ok   <= x-position.ok
)")
