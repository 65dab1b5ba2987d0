// SPDX-License-Identifier: MIT
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <memory>

#include "hal/component.hpp"

namespace {

struct Watchdog : hal::Component {
    using Component::Component;
    static constexpr hal::Traits traits{.singleton = true};

    hal::Argument inputs{*this, "num_inputs", 1, "how many inputs", {.min = 1, .max = 1024}};

    hal::Function process{*this, "process", &Watchdog::watch, "looks for changes of the inputs; fast enough to see each"};
    hal::Ins<bool> input{*this, process, "input-#", inputs, "has to change again and again"};
    hal::In<bool> enable{*this, process, "enable-in", "FALSE: ok-out is FALSE; a rising edge starts the watch anew"};
    hal::Out<bool> ok{*this, process, "ok-out", "TRUE while enabled and no input has been silent for too long", {.safe = false}};
    hal::Out<std::int32_t> tripped{*this, process, "tripped-by", "the input that was silent; -1: none", {.initial = -1}};

    hal::Function run{*this, "set-timeouts", &Watchdog::set_timeouts, "takes new time limits; in any thread"};
    hal::Params<double> timeout{*this, run, "timeout-#", inputs, "longest time input-# may stay as it is; 0 or less: never well", {.unit = "s"}};

    void watch(hal::Cycle cycle) noexcept {
        if (!limits_known_.load(std::memory_order_acquire)) return;  // a rising edge of enable-in is not lost: it is seen later
        const bool restart = enable && !was_enabled_;
        was_enabled_ = enable;
        bool well = enable && (ok || restart);
        if (restart) tripped = -1;
        for (std::size_t i = 0; i < input.size(); ++i) {
            Watched& w = watched_[i];
            if (restart || input[i] != w.level) w.silent_ns = 0;
            else w.silent_ns += cycle.period_ns();
            w.level = input[i];
            if (w.silent_ns < w.limit_ns.load(std::memory_order_relaxed)) continue;
            if (well) tripped = static_cast<std::int32_t>(i);
            well = false;
        }
        ok = well;
    }

    void set_timeouts(hal::Cycle) noexcept {
        for (std::size_t i = 0; i < timeout.size(); ++i) {
            const double seconds = timeout[i];
            watched_[i].limit_ns.store(seconds > 0.0 ? std::llround(std::min(seconds, 1e6) * 1e9) : 0, std::memory_order_relaxed);
        }
        limits_known_.store(true, std::memory_order_release);
    }

private:
    struct Watched {
        std::atomic<std::int64_t> limit_ns{0};  // set-timeouts writes, process reads
        std::int64_t silent_ns = 0;
        bool level = false;
    };
    std::unique_ptr<Watched[]> watched_ = std::make_unique<Watched[]>(static_cast<std::size_t>(inputs));
    std::atomic<bool> limits_known_{false};         // set-timeouts writes, process reads
    bool was_enabled_ = false;
};

}  // namespace

HAL_COMPONENT(Watchdog, "watchdog", "Watches for inputs that stop changing", R"(
Each `input-N` has to change at least once in `timeout-N` seconds. When one does not, `ok-out` goes FALSE and stays so until
`enable-in` has gone FALSE and TRUE again; `tripped-by` says which it was. A timeout that was never set keeps `ok-out`
FALSE: a watch nobody configured must not say that all is well. `set-timeouts` has to be in a thread for the limits to be
taken; the one of `process` has to be fast enough to see each change.

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
