// SPDX-License-Identifier: MIT
#include "hal/component.hpp"
#include "hal/edge.hpp"
#include "hal/journal.hpp"
#include "hal/retained.hpp"
#include "hal/supervision.h"

namespace {

struct Faults : hal::Component {
    using Component::Component;
    static constexpr hal::Traits traits{.singleton = true};

    hal::In<bool> reset{*this, "reset",
                        "a rising edge acknowledges all faults; those that last, once they are "
                        "over while it is TRUE"};
    hal::Out<bool> active{
        *this, "active", "TRUE while a fault is not acknowledged", {.safe = true}};
    hal::Out<bool> ok{*this, "ok", "inverse of active", {.safe = false}};
    hal::Out<std::uint64_t> count{*this, "count", "number of faults since the start"};
    hal::Out<std::uint32_t> last_code{*this, "last-code", "code of the newest fault"};
    hal::Out<std::uint64_t> last_cycle{*this, "last-cycle",
                                       "cycle of its thread in which the newest fault occurred"};
    hal::Out<bool> alive{*this, "alive",
                         "toggles while all supervised threads make progress; for a watchdog"};

    hal::Function run{*this, "", &Faults::update, "reads the fault record of the runtime"};

    void start() {
        record_ = hal::extension<hal_faults>("hal.faults/1");
        if (record_ == nullptr) {
            throw std::runtime_error(
                "the host does not support the extension hal.faults/1 (fault record)");
        }
        supervision_ = hal::extension<hal_supervision>(HAL_SUPERVISION);
    }

    void update(hal::Cycle) noexcept {
        if (record_ == nullptr) return;
        // other threads raise faults at any moment
        count = seen_count_(__atomic_load_n(&record_->count, __ATOMIC_ACQUIRE));
        acknowledge();
        active = count != seen_cleared_(__atomic_load_n(&record_->cleared, __ATOMIC_ACQUIRE));
        ok = !active;
        last_code = seen_code_(__atomic_load_n(&record_->last_code, __ATOMIC_RELAXED));
        last_cycle = seen_cycle_(__atomic_load_n(&record_->last_cycle, __ATOMIC_RELAXED));
        if (supervision_ == nullptr) return;
        const std::uint64_t progress = __atomic_load_n(&supervision_->progress, __ATOMIC_ACQUIRE);
        if (progress != seen_) {
            alive = !alive;
        }
        seen_ = progress;
    }

private:
    // A button often resets drives by the same edge: their faults are over some cycles later. A
    // fault that comes while the button is pressed is not acknowledged, and ends that.
    void acknowledge() noexcept {
        if (reset_edge_.rises(reset)) {
            acknowledged_ = count;
        }
        if (reset && active && acknowledged_ == count) {
            record_->clear(record_);
        } else if (acknowledged_ != count) {
            acknowledged_ = no_count;
        }
    }

    static constexpr std::uint64_t no_count = UINT64_MAX;
    const hal_faults* record_ = nullptr;
    const hal_supervision* supervision_ = nullptr;
    hal::JournaledValue<std::uint64_t> seen_count_, seen_cleared_, seen_cycle_;
    hal::JournaledValue<std::uint32_t> seen_code_;
    std::uint64_t seen_ = 0;
    std::uint64_t acknowledged_ = no_count;  // count at the last edge of reset
    hal::RisingEdge reset_edge_{true};  // TRUE from the first cycle on: not a rising edge
    hal::Retained retained_{
        *this, {{"seen", seen_}, {"acknowledged", acknowledged_}, {"was-reset", reset_edge_}}};
};

}  // namespace

HAL_COMPONENT(Faults, "faults", "Faults of the runtime as pins for the safety chain", R"(
An exception in a component, NaN on an output declared finite, a cycle beyond its budget and a hung
thread are faults; `show fault` describes them. This component provides them as pins: link `ok` into
the emergency stop chain.

A fault whose condition lasts cannot be acknowledged: a thread that hangs or that a fault stopped, a
node that is offline, a cycle that still takes too long. Neither `reset` nor `fault clear` makes
`ok` TRUE before it is over, and its end alone does not either: acknowledge it again, or hold
`reset` until it is over.

`alive` is for a watchdog: it toggles only while the thread supervisor runs and each thread has
finished a cycle within its supervision limit. Add the function to the fastest thread and link
`alive` to a watchdog input, or to a hardware charge pump:
`net alive faults.alive => watchdog.input-0`. It toggles every few milliseconds to 50 ms, so a
timeout of 200 ms or more is suitable for all machines.

| last-code | |
| --- | --- |
| 0 | no fault |
| 1 | a function threw an exception |
| 2 | NaN or infinity on an output declared finite |
| 3 | a cycle took longer than its budget |
| 4 | a thread hangs or gets no CPU time |
| 5 | raised by a component |
| 6 | a function changed what is around it: floating-point modes, the process, its thread |

    loadrt faults
    loadrt estop_latch
    addf faults servo-thread
    addf estop-latch.0 servo-thread
    net runtime-ok faults.ok => estop-latch.0.ok-in
)")
