// SPDX-License-Identifier: MIT
#include "hal/component.hpp"
#include "hal/edge.hpp"
#include "hal/retained.hpp"

namespace {

struct SafetyLatch : hal::Component {
    using Component::Component;
    hal::In<bool> error_in{*this, "error-in", "TRUE: error in this cycle"};
    // language: quoted (LinuxCNC's name)
    hal::In<std::int32_t> heal{
        *this, "heal", "decrement of the count in a cycle without error", {.initial = 1}};
    hal::In<std::int32_t> harm{
        *this, "harm", "increment of the count in a cycle with an error", {.initial = 1}};
    hal::In<bool> latching{
        *this,
        "latching",
        "TRUE: the error remains until reset; FALSE: until the count is at or below threshold",
        {.initial = true}};
    hal::In<bool> reset{*this, "reset", "a rising edge clears the count and the error"};
    hal::In<std::int32_t> threshold{
        *this, "threshold", "a count above this is an error", {.initial = 100}};
    hal::In<std::int32_t> min{*this, "min", "smallest count", {.initial = 0}};
    hal::In<std::int32_t> max{*this, "max", "largest count", {.initial = 1000}};
    hal::In<bool> enable{
        *this,
        "enable",
        "FALSE copies error-in to error-out, and clears the count and a latched error",
        {.initial = true}};
    hal::Out<std::int32_t> count{*this, "count", "current count"};
    hal::Out<bool> error_out{*this, "error-out", "TRUE: error", {.safe = true}};
    hal::Out<bool> ok_out{
        *this, "ok-out", "inverse of error-out", {.initial = true, .safe = false}};
    hal::Function run{*this, "", &SafetyLatch::update, "counts the errors"};

    void update(hal::Cycle) noexcept {
        const bool cleared = reset_edge_.rises(reset);
        if (!enable || cleared) {
            count_ = 0;
            latched_ = false;
        }
        if (enable) {
            count_ += error_in ? std::int64_t{harm} : -std::int64_t{heal};
        }
        count_ = std::min(std::max(count_, std::int64_t{min}), std::int64_t{max});
        const bool above = count_ > threshold;
        latched_ = above || (latched_ && latching);
        const bool error = enable ? latched_ : error_in.get();
        count = static_cast<std::int32_t>(count_);
        error_out = error;
        ok_out = !error;
    }

private:
    std::int64_t count_ = 0;
    bool latched_ = false;
    hal::RisingEdge reset_edge_{true};  // TRUE from the first cycle on: not a rising edge
    hal::Retained retained_{*this,
                            {{"count", count_}, {"latched", latched_}, {"was-reset", reset_edge_}}};
};

}  // namespace

HAL_COMPONENT(SafetyLatch, "safety_latch", "Error latch that tolerates short disturbances", R"(
A cycle with `error-in` TRUE adds `harm` to the count, any other decreases it; the count is limited
to `min` and `max`. A count above `threshold` sets `error-out`. With `latching` it remains TRUE
until a rising edge of `reset`; without, until the count is no longer above the threshold. During a
disturbance, `reset` only restarts the count. If `min` is above `max`, `max` applies. While `enable`
is FALSE, `error-out` is `error-in`, and a latched error is cleared as by `reset`, as in LinuxCNC:
link `enable` to nothing that can switch by itself.

LinuxCNC's manual page contradicts itself about `latching`; its component behaves as described here.

    # tolerate up to 5 bad cycles, forget one in ten good ones
    loadrt safety_latch names=encoder-watch
    addf encoder-watch servo
    setp encoder-watch.harm 10
    setp encoder-watch.threshold 50
    net encoder-fault  => encoder-watch.error-in
    net operator-reset => encoder-watch.reset
    net encoder-ok     <= encoder-watch.ok-out
)")
