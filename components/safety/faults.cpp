// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

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

    hal::Function run{*this, "", &Faults::update, "reads the runtime's record"};

    void start() {
        record_ = hal::extension<hal_faults>("hal.faults/1");
        if (record_ == nullptr) throw std::runtime_error("this host keeps no record of faults");
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
    }

private:
    const hal_faults* record_ = nullptr;
    bool was_reset_ = false;
};

}  // namespace

HAL_COMPONENT(Faults, "faults", "The runtime's record of faults, as pins for the safety chain", R"(
A component that throws, a value that is not a number on an output declared finite, a cycle beyond its budget or a thread
that fell silent is a fault; `show fault` words them. Here they are pins: `ok` belongs into the emergency-stop chain.

| last-code | |
| --- | --- |
| 0 | none so far |
| 1 | a function threw an exception |
| 2 | not a number on an output that has to be finite |
| 3 | a cycle took longer than its budget |
| 4 | a thread did not answer |
| 5 | raised by a component |

    loadrt faults
    loadrt estop_latch
    addf faults servo-thread
    addf estop-latch.0 servo-thread
    net runtime-ok faults.ok => estop-latch.0.ok-in
)")
