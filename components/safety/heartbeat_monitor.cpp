// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "hal/component.hpp"

namespace {

/// Values of pin `reason`. Published: never renumber.
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

enum Mode : std::uint32_t { toggle_edges = 0, rising_edges = 1, any_change = 2, counts_by_step = 3 };

struct HeartbeatMonitor : hal::Component {
    using Component::Component;

    hal::In<bool> toggle{*this, "toggle", "modes 0 and 1: the beat"};
    hal::In<std::uint32_t> counter{*this, "counter", "modes 2 and 3: the beat"};
    hal::In<bool> enable{*this, "enable", "FALSE: not watched, ok is FALSE", {.initial = true}};
    hal::In<bool> reset{*this, "reset", "a rising edge ends a fault and waits for the next beat"};

    hal::Param<std::uint32_t> mode{*this, "mode",
                                   "a beat is 0 each edge of toggle; 1 a rising edge; 2 a change of counter; 3 counter going on by step"};
    hal::Param<std::uint32_t> step{*this, "step", "mode 3: by how much", {.initial = 1}};
    hal::Param<std::uint32_t> bits{*this, "counter-bits", "mode 3: the counter wraps at 2 to the power of this", {.initial = 32}};
    hal::Param<double> timeout{*this, "timeout", "longest time between two beats", {.initial = 0.1, .unit = "s"}};
    hal::Param<double> min_time{*this, "min-time", "shortest time between two beats; 0: none", {.unit = "s"}};
    hal::Param<double> start_time{*this, "start-time", "longest time to the first beat; 0: as timeout", {.unit = "s"}};
    hal::Param<std::uint32_t> beats_needed{*this, "beats-needed", "beats in a row, in time, before ok is TRUE", {.initial = 2}};
    hal::Param<std::uint32_t> misses_allowed{*this, "misses-allowed", "early or skipped beats in a row that are no fault yet"};
    hal::Param<bool> latch{*this, "latch",
                           "TRUE: a fault stays until reset; FALSE: it goes on with the next good beats", {.initial = true}};

    hal::Out<bool> ok{*this, "ok", "TRUE: it beats as it should", {.safe = false}};
    hal::Out<bool> fault{*this, "fault", "TRUE: it did not"};
    hal::Out<std::uint32_t> reason{*this, "reason", "why ok is FALSE: see the table", {.initial = waiting}};
    hal::Out<double> age{*this, "age", "of the last beat", {.unit = "s", .finite = true}};
    hal::Out<double> interval{*this, "interval", "between the last two beats", {.unit = "s", .finite = true}};
    hal::Out<std::uint32_t> beats{*this, "beats", "so far"};
    hal::Out<std::uint32_t> misses{*this, "misses", "beats that came early or with a gap, and silences, so far"};

    hal::Function run{*this, "", &HeartbeatMonitor::update, "watches for the beat"};

    void update(hal::Cycle cycle) noexcept {
        const bool pressed = reset && !was_reset_;
        was_reset_ = reset;
        const bool watched = enable && sound();
        if (!watched || (pressed && fault_ != alive) || !was_watched_) begin();
        if (was_ok_ && !ok && watched && fault_ == alive && latch) fault_ = not_reset;  // the host wrote the safe value
        std::uint32_t wrong = alive;
        const bool beat = watched && beaten(wrong);
        was_watched_ = watched;
        remember();
        if (watched) judge(beat, wrong, cycle.period_ns());
        show(watched);
    }

private:
    static std::int64_t ns(double seconds) noexcept { return std::llround(std::min(seconds, 1e6) * 1e9); }

    bool sound() const noexcept {
        const bool times = timeout > 0.0 && min_time >= 0.0 && start_time >= 0.0 && min_time <= timeout;
        return times && mode <= counts_by_step && bits >= 1 && bits <= 32;
    }

    void begin() noexcept {
        fault_ = alive;
        age_ns_ = 0;
        good_ = bad_ = 0;
        first_ = true;
    }

    /// Whether there is a beat in this cycle; `wrong` says when it is not the one that was due. The first look gives none.
    bool beaten(std::uint32_t& wrong) noexcept {
        if (!was_watched_) return false;
        switch (mode) {
            case toggle_edges: return toggle != last_toggle_;
            case rising_edges: return toggle && !last_toggle_;
            case any_change: return counter != last_counter_;
            default: {
                const std::uint32_t mask = bits >= 32 ? UINT32_MAX : (std::uint32_t{1} << bits) - 1;
                const std::uint32_t moved = (counter - last_counter_) & mask;
                if (moved != 0 && moved != (step & mask) && !first_) wrong = skipped;
                return moved != 0;
            }
        }
    }
    void remember() noexcept {
        last_toggle_ = toggle;
        last_counter_ = counter;
    }

    void judge(bool beat, std::uint32_t wrong, std::int64_t period_ns) noexcept {
        age_ns_ = std::min(age_ns_ + period_ns, std::int64_t{1} << 60);
        if (beat) {
            if (!first_ && wrong == alive && age_ns_ < ns(min_time)) wrong = too_early;
            if (!first_) interval_ns_ = age_ns_;
            beats = beats + 1;
            age_ns_ = 0;
            first_ = false;
            if (wrong == alive) bad_ = 0, good_ = std::min(good_ + 1, UINT32_MAX - 1);
            else miss(wrong, bad_ >= misses_allowed);
            if (!latch && fault_ != alive && wrong == alive && good_ >= beats_needed) fault_ = alive;
        } else if (age_ns_ > ns(first_ && start_time > 0.0 ? start_time : timeout)) {
            if (fault_ != silent) miss(silent, true);
        }
    }
    void miss(std::uint32_t why, bool counts) noexcept {
        misses = misses + 1;
        if (bad_ < UINT32_MAX) ++bad_;
        if (!counts) return;
        good_ = 0;
        if (fault_ == alive || !latch) fault_ = why;
    }

    void show(bool watched) noexcept {
        const bool well = watched && fault_ == alive && good_ >= beats_needed && !first_;
        was_ok_ = well;
        ok = well;
        fault = watched ? fault_ != alive : enable.get();
        if (!watched) reason = enable ? bad_parameter : disabled;
        else reason = fault_ != alive ? fault_ : well ? std::uint32_t{alive} : std::uint32_t{waiting};
        age = static_cast<double>(age_ns_) * 1e-9;
        interval = static_cast<double>(interval_ns_) * 1e-9;
    }

    std::int64_t age_ns_ = 0, interval_ns_ = 0;
    std::uint32_t last_counter_ = 0, good_ = 0, bad_ = 0, fault_ = alive;
    bool last_toggle_ = false, was_watched_ = false, was_reset_ = false, first_ = true, was_ok_ = false;
};

}  // namespace

HAL_COMPONENT(HeartbeatMonitor, "heartbeat_monitor", "Watches the heartbeat of a partner: a bit that toggles or a counter", R"(
Watches that something beats: a bit that toggles, a counter that goes on (a bus node's life counter, another computer, a user-space
program). The time between two beats has to lie in a window, from `min-time` to `timeout` (a window watchdog). `ok` rises after
`beats-needed` good beats. Silence is a fault at once, a beat that comes early or with a gap when more than `misses-allowed` come in a
row. A fault stays until a rising edge of `reset`; without `latch` until there were `beats-needed` good beats. After a stop of the runtime
with `latch` a reset is needed, too.

`watchdog` watches many bits for silence alone; this one watches one partner closely. The thread has to see every beat.

| reason | |
| --- | --- |
| 0 | it beats |
| 1 | waiting for enough beats |
| 2 | fault: no beat for `timeout`, or no first one for `start-time` |
| 3 | fault: a beat before `min-time` |
| 4 | fault: mode 3, the counter went on by something else than `step` |
| 5 | fault: a parameter makes no sense (timeout 0 or below min-time, mode above 3, counter-bits not 1 to 32) |
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
