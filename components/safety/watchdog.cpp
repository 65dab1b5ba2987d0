// SPDX-License-Identifier: MIT
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <memory>

#include "hal/component.hpp"
#include "hal/edge.hpp"
#include "hal/retained.hpp"

namespace {

struct Watchdog : hal::Component {
    using Component::Component;
    static constexpr hal::Traits traits{.singleton = true};

    hal::Argument inputs{*this, "num_inputs", 1, "number of inputs", {.min = 1, .max = 1024}};

    hal::Function process{*this, "process", &Watchdog::watch,
                          "monitors the inputs; its thread must be fast enough to see each change"};
    hal::Ins<bool> input{*this, process, "input-#", inputs, "heartbeat input: must keep changing"};
    hal::In<bool> enable{*this, process, "enable-in",
                         "FALSE sets ok-out to FALSE; a rising edge restarts the watchdog"};
    hal::Out<bool> ok{
        *this, process, "ok-out", "TRUE while enabled and no input has timed out", {.safe = false}};
    hal::Out<std::int32_t> tripped{*this,
                                   process,
                                   "tripped-by",
                                   "number of the input that timed out; -1: none",
                                   {.initial = -1}};

    hal::Function run{*this, "set-timeouts", &Watchdog::set_timeouts,
                      "reads the timeouts; in any thread"};
    hal::Params<double> timeout{
        *this,
        run,
        "timeout-#",
        inputs,
        "maximum time between changes of input-#; 0 or less: always tripped",
        {.unit = "s"}};

    void watch(hal::Cycle cycle) noexcept {
        // a rising edge of enable-in is not lost: it is detected later
        if (!limits_known_.load(std::memory_order_acquire)) return;
        const bool restart = enable_edge_.rises(enable);
        const bool all_alive = note_signs_of_life();
        starting_ = enable && (restart || starting_);
        if (!enable) {
            ok = false;
        } else if (starting_) {
            if (all_alive) {
                begin();
            }
        } else if (ok) {
            check(cycle.period_ns());
        }
    }

    void set_timeouts(hal::Cycle) noexcept {
        constexpr double max = 9e9;  // s; what the integer can hold, 285 years
        for (std::size_t i = 0; i < timeout.size(); ++i) {
            const double seconds = timeout[i];
            watched_[i].limit_ns.store(
                seconds > 0.0 ? std::llround(std::min(seconds, max) * 1e9) : 0,
                std::memory_order_relaxed);
        }
        limits_known_.store(true, std::memory_order_release);
    }

private:
    /// Returns true if all inputs that tripped the watchdog have changed since. [realtime]
    bool note_signs_of_life() noexcept {
        bool all_alive = true;
        for (std::size_t i = 0; i < input.size(); ++i) {
            Watched& w = watched_[i];
            w.dead = w.dead && input[i] == w.level;
            all_alive = all_alive && !w.dead;
        }
        return all_alive;
    }

    void begin() noexcept {
        starting_ = false;
        tripped = -1;
        ok = true;
        for (std::size_t i = 0; i < input.size(); ++i) {
            watched_[i].silent_ns = 0;
            if (watched_[i].limit_ns.load(std::memory_order_relaxed) == 0) {
                trip(i);
            }
        }
    }

    void check(std::int64_t period_ns) noexcept {
        for (std::size_t i = 0; i < input.size(); ++i) {
            Watched& w = watched_[i];
            const std::int64_t limit_ns = w.limit_ns.load(std::memory_order_relaxed);
            w.silent_ns = input[i] == w.level ? w.silent_ns + period_ns : 0;
            w.level = input[i];
            w.dead = limit_ns > 0 && w.silent_ns > limit_ns;
            if (limit_ns == 0 || w.dead) {
                trip(i);
            }
        }
    }

    void trip(std::size_t i) noexcept {
        if (ok) {
            tripped = static_cast<std::int32_t>(i);
        }
        ok = false;
    }

    struct Watched {
        static constexpr bool retainable = true;
        std::atomic<std::int64_t> limit_ns{0};  // set-timeouts writes, process reads
        std::int64_t silent_ns = 0;
        bool level = false;
        bool dead = false;  // it tripped the watchdog and has not changed since
    };
    std::unique_ptr<Watched[]> watched_ =
        std::make_unique<Watched[]>(static_cast<std::size_t>(inputs));
    std::atomic<bool> limits_known_{false};  // set-timeouts writes, process reads
    hal::RisingEdge enable_edge_;
    // enabled, and ok-out waits for an input that tripped the watchdog
    bool starting_ = false;
    hal::Retained retained_{*this,
                            {{"watched", watched_.get(), static_cast<std::size_t>(inputs)},
                             {"limits-known", limits_known_},
                             {"was-enabled", enable_edge_},
                             {"starting", starting_}}};
};

}  // namespace

HAL_COMPONENT(Watchdog, "watchdog", "Detects inputs that stop changing", R"(
Each `input-N` must change at least once in `timeout-N` seconds. If one does not, `ok-out` becomes
FALSE and remains so until a rising edge of `enable-in`; `tripped-by` is the number of the input. If
that input has not changed since, `ok-out` waits for its next change: LinuxCNC's watchdog reports OK
for another timeout over an input that is still dead. Without a timeout `ok-out` is always FALSE: a
watchdog that is not configured must not report OK. Add `set-timeouts` to a thread for the timeouts
to take effect; the thread of `process` must be fast enough to see each change. A rising edge of
`enable-in` begins a new timeout, as in LinuxCNC: an `enable-in` that rises more often than the
timeout hides an input that is dead. Link it to a button, not to a signal that can oscillate.

    loadrt watchdog num_inputs=2
    loadrt charge_pump
    loadrt estop_latch
    addf charge-pump servo-thread
    addf watchdog.process servo-thread
    addf watchdog.set-timeouts servo-thread
    addf estop-latch.0 servo-thread
    setp watchdog.timeout-0 0.01
    setp watchdog.timeout-1 0.1
    net alive  charge-pump.out => watchdog.input-0
    net watch-ok watchdog.ok-out => estop-latch.0.ok-in
)")
