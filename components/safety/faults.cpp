// SPDX-License-Identifier: MIT
#include "hal/component.hpp"
#include "hal/supervision.h"

namespace {

struct Faults : hal::Component {
    using Component::Component;
    static constexpr hal::Traits traits{.singleton = true};

    hal::In<bool> reset{*this, "reset", "rising edge: acknowledges the faults so far"};
    hal::Out<bool> active{*this, "active", "TRUE while there is a fault nobody has acknowledged", {.safe = true}};
    hal::Out<bool> ok{*this, "ok", "the opposite of active", {.safe = false}};
    hal::Out<std::uint64_t> count{*this, "count", "faults since the start"};
    hal::Out<std::uint32_t> last_code{*this, "last-code", "what the newest was"};
    hal::Out<std::uint64_t> last_cycle{*this, "last-cycle", "in which cycle of its thread"};
    hal::Out<bool> alive{*this, "alive", "changes in each cycle that follows progress of all supervised threads: for a watchdog"};

    hal::Function run{*this, "", &Faults::update, "reads the runtime's record"};

    void start() {
        record_ = hal::extension<hal_faults>("hal.faults/1");
        if (record_ == nullptr) throw std::runtime_error("this host keeps no record of faults");
        supervision_ = hal::extension<hal_supervision>(HAL_SUPERVISION);
    }

    void update(hal::Cycle) noexcept {
        if (record_ == nullptr) return;
        if (reset && !was_reset_) record_->clear(record_);
        was_reset_ = reset;
        count = __atomic_load_n(&record_->count, __ATOMIC_ACQUIRE);
        active = count != __atomic_load_n(&record_->cleared, __ATOMIC_ACQUIRE);
        ok = !active;
        last_code = __atomic_load_n(&record_->last_code, __ATOMIC_RELAXED);
        last_cycle = __atomic_load_n(&record_->last_cycle, __ATOMIC_RELAXED);
        if (supervision_ == nullptr) return;
        const std::uint64_t progress = __atomic_load_n(&supervision_->progress, __ATOMIC_ACQUIRE);
        if (progress != seen_) alive = !alive;
        seen_ = progress;
    }

private:
    const hal_faults* record_ = nullptr;
    const hal_supervision* supervision_ = nullptr;
    std::uint64_t seen_ = 0;
    bool was_reset_ = false;
};

}  // namespace

HAL_COMPONENT(Faults, "faults", "The runtime's record of faults, as pins for the safety chain", R"(
A component that throws, a value that is not a number on an output declared finite, a cycle beyond its budget or a thread
that hangs is a fault; `show fault` describes them. Here they are pins: `ok` belongs into the emergency-stop chain.

`alive` feeds a watchdog: it changes only while the supervisor of the threads runs and finds that each thread has finished a
cycle within its supervision limit. Put the function into the fastest thread and link `alive` to a watchdog input, or to a
hardware charge pump: `net alive faults.alive => watchdog.input-0`. It changes every few milliseconds up to 50 ms, so a
timeout of 200 ms or more fits all machines.

| last-code | |
| --- | --- |
| 0 | none so far |
| 1 | a function threw an exception |
| 2 | not a number on an output that has to be finite |
| 3 | a cycle took longer than its budget |
| 4 | a thread hangs |
| 5 | raised by a component |

    loadrt faults
    loadrt estop_latch
    addf faults servo-thread
    addf estop-latch.0 servo-thread
    net runtime-ok faults.ok => estop-latch.0.ok-in
)")
