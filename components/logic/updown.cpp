// SPDX-License-Identifier: MIT
#include "hal/component.hpp"
#include "hal/retained.hpp"

namespace {

struct Updown : hal::Component {
    using Component::Component;
    hal::In<bool> count_up{*this, "countup", "a rising edge counts up"};
    hal::In<bool> count_down{*this, "countdown", "a rising edge counts down"};
    hal::In<bool> reset{*this, "reset", "TRUE sets the count to 0"};
    hal::Out<std::int32_t> count{*this, "count", "count"};
    hal::Param<bool> clamp{*this, "clamp", "TRUE limits the count to min and max"};
    hal::Param<bool> wrap{
        *this, "wrap",
        "TRUE: the count wraps around between max and min; takes precedence over clamp"};
    hal::Param<std::int32_t> max{*this, "max", "largest count", {.initial = INT32_MAX}};
    hal::Param<std::int32_t> min{*this, "min", "smallest count"};
    hal::Function run{*this, "", hal::step<&Updown::update>, "counts edges"};

    void update(hal::Cycle) noexcept {
        const bool up = count_up;
        const bool down = count_down;
        std::int64_t n = count_;
        if (started_) {
            n += int{up && !was_up_} - int{down && !was_down_};
        }
        if (reset) {
            n = 0;
        }
        started_ = true;
        was_up_ = up;
        was_down_ = down;
        if (wrap || clamp) {
            if (n > max) {
                n = (wrap ? min : max).get();
            } else if (n < min) {
                n = (wrap ? max : min).get();
            } else {
                n = n;
            }
        }
        count_ = static_cast<std::int32_t>(n);
        count = count_;
    }

private:
    std::int32_t count_ = 0;
    bool started_ = false;
    bool was_up_ = false;
    bool was_down_ = false;
    hal::Retained retained_{
        *this,
        {{"count", count_}, {"started", started_}, {"was-up", was_up_}, {"was-down", was_down_}}};
};

}  // namespace

HAL_COMPONENT(Updown, "updown", "Counts up and down, with limits or wrap-around", R"(
Rising edges of `countup` and `countdown` count; both in one cycle cancel, and the first cycle has
no edges. While `reset` is TRUE the count is 0, or with `clamp` or `wrap` the limit nearest to 0 or
the wrapped value. Without `clamp` and `wrap` the count wraps around at the limits of its type. If
`min` is above `max`, `max` is checked first.

    loadrt updown names=parts
    addf parts servo
    setp parts.clamp TRUE
    net part-done  => parts.countup
    net shift-done => parts.reset
    net part-count <= parts.count
)")
