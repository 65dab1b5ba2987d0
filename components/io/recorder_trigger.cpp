// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "hal/component.hpp"
#include "hal/edge.hpp"
#include "hal/retained.hpp"

namespace {

enum BitMode : std::uint32_t {
    bit_unused = 0,
    bit_rises = 1,
    bit_falls = 2,
    bit_changes = 3,
    bit_true = 4,
    bit_false = 5
};
enum ValueMode : std::uint32_t {
    value_unused = 0,
    value_rises = 1,
    value_falls = 2,
    value_crosses = 3,
    value_above = 4,
    value_below = 5,
    value_outside = 6,
    value_inside = 7,
};

/// Values of pin `state`.
enum State : std::uint32_t { idle = 0, filling = 1, armed = 2, recording = 3, holding_off = 4 };

struct RecorderTrigger : hal::Component {
    using Component::Component;

    hal::Argument channels{
        *this, "channels", 4, "number of values to delay", {.min = 0, .max = 64}};
    hal::Argument bit_channels{*this, "bits", 0, "number of bits to delay", {.min = 0, .max = 64}};
    hal::Argument depth{
        *this, "depth", 1000, "maximum pre-trigger in cycles", {.min = 1, .max = 10'000'000}};

    hal::In<bool> arm{*this, "arm", "a rising edge arms; FALSE disarms"};
    hal::In<bool> again{*this, "auto-arm", "TRUE arms again after each record"};
    hal::In<bool> force{*this, "force", "a rising edge triggers regardless of the conditions"};
    hal::In<bool> bit{*this, "trigger-bit", "bit for the trigger condition"};
    hal::In<double> value{*this, "trigger-value", "value for the trigger condition"};
    hal::Param<std::uint32_t> bit_mode{
        *this,
        "bit-mode",
        "0 unused; trigger-bit 1 rises, 2 falls, 3 changes, 4 is TRUE, 5 is FALSE",
        {.initial = bit_rises}};
    hal::Param<std::uint32_t> value_mode{
        *this, "value-mode",
        "0 unused; trigger-value 1 rises, 2 falls, 3 crosses, 4 is above, 5 is below threshold; "
        "6 is outside, 7 is inside threshold and threshold-2"};
    hal::Param<double> threshold{*this, "threshold", "threshold for trigger-value"};
    hal::Param<double> threshold_2{*this, "threshold-2", "other limit of the window"};
    hal::Param<double> hysteresis{*this, "hysteresis",
                                  "distance from threshold that trigger-value must reach on the "
                                  "other side before the next edge"};
    hal::Param<bool> both{
        *this, "both",
        "TRUE: both conditions must be met in the same cycle; FALSE: either condition"};
    hal::Param<std::uint32_t> pre{
        *this, "pre", "cycles to record before the trigger", {.initial = 100}};
    hal::Param<std::uint32_t> post{
        *this, "post", "cycles to record from the trigger on", {.initial = 900}};
    hal::Param<double> hold_off{*this, "hold-off", "auto-arm: delay after a record", {.unit = "s"}};

    hal::Ins<double> in{*this, "in-##", channels, "value to record"};
    hal::Ins<bool> bit_in{*this, "bit-in-##", bit_channels, "bit to record"};
    hal::Outs<double> out{*this, "out-##", channels, "in-##, delayed by pre cycles"};
    hal::Outs<bool> bit_out{*this, "bit-out-##", bit_channels, "bit-in-##, delayed by pre cycles"};
    hal::Out<bool> record{*this, "record",
                          "TRUE for pre + post cycles; link it to the sampler's enable"};
    hal::Out<bool> triggered{*this, "triggered", "TRUE in the cycle of the trigger"};
    hal::Out<bool> done{*this, "done",
                        "TRUE: the record is complete and the trigger is not armed again"};
    hal::Out<std::uint32_t> state{
        *this, "state", "0 idle; 1 filling the pre-trigger; 2 armed; 3 recording; 4 hold-off"};
    hal::Out<std::int32_t> index{
        *this, "index", "cycle of out-## relative to the trigger: -pre at the start of the record"};
    hal::Out<std::uint32_t> records{*this, "records", "number of records so far"};

    hal::Function run{*this, "", &RecorderTrigger::update,
                      "delays the values and detects the trigger"};

    void update(hal::Cycle cycle) noexcept {
        const bool armed_now = arm_edge_.rises(arm);
        const bool forced = force_edge_.rises(force);
        store();
        const bool fires = looks();
        const std::uint32_t before = std::min(pre.get(), static_cast<std::uint32_t>(size_ - 1));
        bool starts = false;
        if (state_ != recording) {
            follow_arming(armed_now, before, cycle.seconds());
            starts = forced || (state_ == armed && fires);
        }
        if (starts) {
            begin(before);
        }

        give();
        record = state_ == recording;
        triggered = starts;
        index = state_ == recording ? static_cast<std::int32_t>(at_) : 0;
        if (state_ == recording && ++at_ >= after_) {
            finish();
        }
        done = have_ && state_ == idle && !record;
        state = record ? std::uint32_t{recording} : state_;
    }

private:
    /// Advances a recorder that records nothing: arms it when the pre-trigger is filled.
    void follow_arming(bool armed_now, std::uint32_t before, double dt) noexcept {
        if (!arm) {
            state_ = idle;
        } else if (armed_now) {
            state_ = filling;
            filled_ = 0;  // cycles before arming belong to no record
        }
        if (state_ == holding_off && (waited_ += dt) > hold_off) {
            state_ = filling;
        }
        if (state_ != filling) return;
        if (filled_ >= before) {
            state_ = armed;
        } else {
            ++filled_;
        }
    }
    void begin(std::uint32_t before) noexcept {
        state_ = recording;
        back_ = before;
        at_ = -static_cast<std::int64_t>(before);
        after_ = std::max<std::int64_t>(1, std::min<std::uint32_t>(post, INT32_MAX));
        records = records + 1;
        have_ = true;
    }
    void finish() noexcept {
        state_ = again && arm ? std::uint32_t{holding_off} : std::uint32_t{idle};
        waited_ = 0.0;
    }

    void store() noexcept {
        newest_ = (newest_ + 1) % size_;
        std::ranges::copy(in, values_.get() + newest_ * in.size());
        std::ranges::copy(bit_in, bits_.get() + newest_ * bit_in.size());
    }
    /// Outputs the delayed values; during a record with the delay at its trigger.
    void give() noexcept {
        const std::size_t back =
            state_ == recording ? back_ : std::min<std::size_t>(pre, size_ - 1);
        const std::size_t from = (newest_ + size_ - back) % size_;
        std::copy_n(values_.get() + from * out.size(), out.size(), out.begin());
        std::copy_n(bits_.get() + from * bit_out.size(), bit_out.size(), bit_out.begin());
    }

    bool looks() noexcept {
        const bool b = bit_fires();
        const bool v = value_fires();
        if (bit_mode == bit_unused || bit_mode > bit_false) return v;
        if (value_mode == value_unused || value_mode > value_inside) return b;
        return both ? b && v : b || v;
    }
    bool bit_fires() noexcept {
        const bool now = bit;
        const bool before = was_known_ ? was_bit_ : now;
        was_bit_ = now;
        was_known_ = true;
        switch (bit_mode) {
        case bit_rises: return now && !before;
        case bit_falls: return !now && before;
        case bit_changes: return now != before;
        case bit_true: return now;
        case bit_false: return !now;
        default: return false;
        }
    }
    /// An edge counts only after the value has been beyond the hysteresis on the other side.
    bool value_fires() noexcept {
        const double x = value;
        const double band = std::fabs(hysteresis);
        const bool rises = was_below_ && x >= threshold;
        const bool falls = was_above_ && x <= threshold;
        was_below_ = x < threshold - band || (was_below_ && !rises);
        was_above_ = x > threshold + band || (was_above_ && !falls);
        const double low = std::min(threshold.get(), threshold_2.get());
        const double high = std::max(threshold.get(), threshold_2.get());
        switch (value_mode) {
        case value_rises: return rises;
        case value_falls: return falls;
        case value_crosses: return rises || falls;
        case value_above: return x > threshold;
        case value_below: return x < threshold;
        case value_outside: return x < low || x > high;
        case value_inside: return x >= low && x <= high;
        default: return false;
        }
    }

    std::size_t size_ = static_cast<std::size_t>(depth) + 1;
    std::size_t newest_ = 0;
    std::size_t back_ = 0;
    std::size_t filled_ = 0;
    std::unique_ptr<double[]> values_ =
        std::make_unique<double[]>(size_ * static_cast<std::size_t>(channels));
    std::unique_ptr<bool[]> bits_ =
        std::make_unique<bool[]>(size_ * static_cast<std::size_t>(bit_channels));
    std::int64_t at_ = 0;
    std::int64_t after_ = 1;
    double waited_ = 0.0;
    std::uint32_t state_ = idle;
    hal::RisingEdge arm_edge_;
    hal::RisingEdge force_edge_;
    bool was_bit_ = false;
    bool was_known_ = false;

    bool was_below_ = false;
    bool was_above_ = false;
    bool have_ = false;
    hal::Retained retained_{*this,
                            {{"newest", newest_},
                             {"back", back_},
                             {"filled", filled_},
                             {"values", values_.get(), size_* static_cast<std::size_t>(channels)},
                             {"bits", bits_.get(), size_* static_cast<std::size_t>(bit_channels)},
                             {"at", at_},
                             {"after", after_},
                             {"waited", waited_},
                             {"state", state_},
                             {"was-arm", arm_edge_},
                             {"was-force", force_edge_},
                             {"was-bit", was_bit_},
                             {"was-known", was_known_},
                             {"was-below", was_below_},
                             {"was-above", was_above_},
                             {"have", have_}}};
};

}  // namespace

HAL_COMPONENT(RecorderTrigger, "recorder_trigger",
              "Triggers a record of the cycles before and after an event", R"(
Extends `sampler` to a transient recorder: the values are delayed by `pre` cycles, and `record`
enables the sampler from the trigger on for `pre` + `post` cycles, so the record starts `pre` cycles
before the trigger. `index` is the number of the cycle; record it, too.

A rising edge of `arm` arms the trigger; it is active once `pre` cycles have been stored. The
conditions are `trigger-bit` (`bit-mode`) and `trigger-value` (`value-mode`, `threshold`), either of
them or, with `both`, both in the same cycle; `force` triggers at any time. For an edge, the value
must first be beyond `hysteresis` on the other side. With `auto-arm` the trigger is armed again
`hold-off` after each record. `arm` FALSE disarms, but does not end a record. A record forced before
the pre-trigger is full starts with older values.

The memory is allocated when the component is loaded: `depth` cycles (the limit of `pre`), 8 bytes
per value. Add the functions in this order: the sources of the values, this component, the sampler.

    loadrt recorder_trigger names=catch channels=2 depth=2000
    loadrt sampler depth=4000 cfg=ffs
    addf catch servo
    addf sampler.0 servo
    setp catch.bit-mode 0
    setp catch.value-mode 1
    setp catch.threshold 0.5
    setp catch.pre 1000
    setp catch.post 1000
    setp catch.arm TRUE
    net x-error  => catch.in-00 catch.trigger-value
    net x-effort => catch.in-01
    net caught   catch.record => sampler.0.enable
    net error-late   catch.out-00 => sampler.0.pin.0
    net effort-late  catch.out-01 => sampler.0.pin.1
    net caught-at    catch.index  => sampler.0.pin.2
)")
