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
    alive = 0,
    waiting = 1,
    silent = 2,
    too_early = 3,
    skipped = 4,
    bad_parameter = 5,
    disabled = 6,
    not_reset = 7,
};

enum Mode : std::uint32_t {
    toggle_edges = 0,
    rising_edges = 1,
    any_change = 2,
    counts_by_step = 3
};

struct HeartbeatMonitor : hal::Component {
    using Component::Component;

    hal::In<bool> toggle{*this, "toggle", "modes 0 and 1: heartbeat bit"};
    hal::In<std::uint32_t> counter{*this, "counter", "modes 2 and 3: heartbeat counter"};
    hal::In<bool> enable{
        *this, "enable", "FALSE disables the monitor; ok is FALSE", {.initial = true}};
    hal::In<bool> reset{*this, "reset",
                        "a rising edge clears a fault and waits for the next heartbeat"};

    hal::Param<std::uint32_t> mode{*this, "mode",
                                   "heartbeat: 0 each edge of toggle; 1 rising edge; 2 change of "
                                   "counter; 3 increment of counter by step"};
    hal::Param<std::uint32_t> step{
        *this, "step", "mode 3: increment of the counter", {.initial = 1}};
    hal::Param<std::uint32_t> bits{*this,
                                   "counter-bits",
                                   "mode 3: width of the counter; it wraps at 2^counter-bits",
                                   {.initial = 32}};
    hal::Param<double> timeout{
        *this, "timeout", "maximum time between two heartbeats", {.initial = 0.1, .unit = "s"}};
    hal::Param<double> min_time{
        *this, "min-time", "minimum time between two heartbeats; 0: not monitored", {.unit = "s"}};
    hal::Param<double> start_time{
        *this, "start-time", "timeout of the first heartbeat; 0: timeout", {.unit = "s"}};
    hal::Param<std::uint32_t> beats_needed{*this,
                                           "heartbeats-needed",
                                           "consecutive heartbeats in time before ok is TRUE",
                                           {.initial = 2}};
    hal::Param<std::uint32_t> misses_allowed{
        *this, "misses-allowed", "tolerated consecutive heartbeats that are early or skipped"};
    hal::Param<bool> latch{
        *this,
        "latch",
        "TRUE: a fault remains until reset; FALSE: until the next valid heartbeats",
        {.initial = true}};

    hal::Out<bool> ok{*this, "ok", "TRUE: the heartbeat is valid", {.safe = false}};
    hal::Out<bool> fault{*this, "fault", "TRUE: the heartbeat failed"};
    hal::Out<std::uint32_t> reason{
        *this, "reason", "reason why ok is FALSE: see the table", {.initial = waiting}};
    hal::Out<double> age{
        *this, "age", "time since the last heartbeat", {.unit = "s", .finite = true}};
    hal::Out<double> interval{
        *this, "interval", "time between the last two heartbeats", {.unit = "s", .finite = true}};
    hal::Out<std::uint32_t> beats{*this, "heartbeats", "number of heartbeats so far"};
    hal::Out<std::uint32_t> misses{*this, "misses",
                                   "number of early or skipped heartbeats and timeouts so far"};

    hal::Function run{*this, "", &HeartbeatMonitor::update, "monitors the heartbeat"};

    void update(hal::Cycle cycle) noexcept {
        const bool pressed = reset_edge_.rises(reset);
        const bool watched = enable && sound();
        if (!watched || (pressed && fault_ != alive) || !was_watched_) {
            begin();
        }
        // the host wrote the safe value
        if (was_ok_ && !ok && watched && fault_ == alive && latch) {
            fault_ = not_reset;
        }
        if (watched) {
            follow(cycle.period_ns());
        }
        was_watched_ = watched;
        last_toggle_ = toggle;
        last_counter_ = counter;
        show(watched);
    }

private:
    static std::int64_t ns(double seconds) noexcept {
        constexpr double max = 9e9;  // s; what the integer can hold, 285 years
        return std::llround(std::min(seconds, max) * 1e9);
    }

    bool sound() const noexcept {
        const bool times =
            timeout > 0.0 && min_time >= 0.0 && start_time >= 0.0 && min_time <= timeout;
        return times && mode <= counts_by_step && bits >= 1 && bits <= 32;
    }

    void begin() noexcept {
        fault_ = alive;
        age_ns_ = 0;
        good_ = bad_ = 0;
        first_ = true;
    }

    /// Returns the increment of the counter in its width.
    std::uint32_t increment() const noexcept { return (counter - last_counter_) & mask(); }
    std::uint32_t mask() const noexcept { return UINT32_MAX >> (32 - bits); }

    /// Returns whether there is a heartbeat in this cycle. The first cycle has none.
    bool received() const noexcept {
        if (!was_watched_) return false;
        switch (mode) {
        case toggle_edges: return toggle != last_toggle_;
        case rising_edges: return toggle && !last_toggle_;
        case any_change: return counter != last_counter_;
        default: return increment() != 0;
        }
    }

    /// Returns what is wrong with the heartbeat of this cycle; `alive`: nothing.
    std::uint32_t defect() const noexcept {
        if (first_) return alive;
        if (mode == counts_by_step && increment() != (step & mask())) return skipped;
        return age_ns_ < ns(min_time) ? too_early : alive;
    }

    void follow(std::int64_t period_ns) noexcept {
        age_ns_ = std::min(age_ns_ + period_ns, std::int64_t{1} << 60);
        if (received()) return accept(defect());
        const double limit = first_ && start_time > 0.0 ? start_time : timeout;
        if (age_ns_ > ns(limit) && fault_ != silent) {
            miss(silent, true);
        }
    }

    void accept(std::uint32_t wrong) noexcept {
        if (!first_) {
            interval_ns_ = age_ns_;
        }
        beats = beats + 1;
        age_ns_ = 0;
        first_ = false;
        if (wrong != alive) return miss(wrong, bad_ >= misses_allowed);
        bad_ = 0;
        good_ = std::min(good_ + 1, UINT32_MAX - 1);
        if (!latch && good_ >= beats_needed) {
            fault_ = alive;
        }
    }
    void miss(std::uint32_t why, bool counts) noexcept {
        misses = misses + 1;
        if (bad_ < UINT32_MAX) {
            ++bad_;
        }
        if (!counts) return;
        good_ = 0;
        if (fault_ == alive || !latch) {
            fault_ = why;
        }
    }

    void show(bool watched) noexcept {
        const bool healthy = watched && fault_ == alive && good_ >= beats_needed && !first_;
        was_ok_ = healthy;
        ok = healthy;
        fault = watched ? fault_ != alive : enable.get();
        reason = shown_reason(watched);
        age = static_cast<double>(age_ns_) * 1e-9;
        interval = static_cast<double>(interval_ns_) * 1e-9;
    }

    std::uint32_t shown_reason(bool watched) const noexcept {
        if (!enable) return disabled;
        if (!watched) return bad_parameter;
        if (fault_ != alive) return fault_;
        return was_ok_ ? alive : waiting;
    }

    std::int64_t age_ns_ = 0;
    std::int64_t interval_ns_ = 0;
    std::uint32_t last_counter_ = 0;
    std::uint32_t good_ = 0;
    std::uint32_t bad_ = 0;
    std::uint32_t fault_ = alive;
    bool last_toggle_ = false;
    bool was_watched_ = false;
    hal::RisingEdge reset_edge_{true};  // TRUE from the first cycle on: not a rising edge
    bool first_ = true;

    bool was_ok_ = false;
    hal::Retained retained_{*this,
                            {{"age-ns", age_ns_},
                             {"interval-ns", interval_ns_},
                             {"last-counter", last_counter_},
                             {"good", good_},
                             {"bad", bad_},
                             {"fault", fault_},
                             {"last-toggle", last_toggle_},
                             {"was-watched", was_watched_},
                             {"was-reset", reset_edge_},
                             {"first", first_},
                             {"was-ok", was_ok_}}};
};

}  // namespace

HAL_COMPONENT(HeartbeatMonitor, "heartbeat_monitor",
              "Monitors a heartbeat: a toggling bit or a counter", R"(
Monitors a heartbeat, such as a toggling bit or an increasing counter (the life counter of a bus
node, another computer, a user-space program). The time between two heartbeats must be within
`min-time` and `timeout` (a window watchdog). `ok` becomes TRUE after `heartbeats-needed` valid
heartbeats. A timeout is an immediate fault; early or skipped heartbeats are a fault if more than
`misses-allowed` occur in a row. A fault remains until a rising edge of `reset`, or without `latch`
until `heartbeats-needed` valid heartbeats. After a stop of the runtime, `latch` requires a reset,
too.

`watchdog` monitors many bits for timeouts only; this component monitors one source in detail. The
thread must be fast enough to see every heartbeat.

| reason | |
| --- | --- |
| 0 | heartbeat valid |
| 1 | waiting for enough heartbeats |
| 2 | fault: no heartbeat for `timeout`, or no first one for `start-time` |
| 3 | fault: heartbeat before `min-time` |
| 4 | fault: mode 3, the counter did not increase by `step` |
| 5 | fault: invalid parameter (timeout 0 or below min-time, mode above 3, counter-bits not in 1..32) |
| 6 | enable is FALSE |
| 7 | waiting for the reset after a stop of the runtime |

    loadrt heartbeat_monitor names=drive-alive
    addf drive-alive servo
    setp drive-alive.mode 3
    setp drive-alive.counter-bits 8
    setp drive-alive.timeout 0.02
    net drive-life-counter => drive-alive.counter
    net drive-is-alive     <= drive-alive.ok
)")
