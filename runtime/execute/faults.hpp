// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <cstdint>

#include "hal/abi.h"
#include "hal/queue.hpp"

namespace hal {

/// One fault as the cycle records it: numbers only. The session words it.
struct FaultEvent {
    hal_fault_code code = HAL_FAULT_NONE;
    std::uint32_t subject = 0;      ///< the model's number of a function (exception, budget) or pin (not finite)
    std::uint64_t cycle = 0;
    std::int64_t time_ns = 0;
    double value = 0.0;             ///< budget: ns it took; component: its detail
    const char* reason = nullptr;   ///< component faults: a literal of the component
    const void* self = nullptr;     ///< component faults: the instance
};

/// What is common to all threads; the component `faults` and the session read it.
struct FaultBoard {
    hal_faults shared{};                    ///< given out as extension "hal.faults/1"; written with atomic builtins
    /// Any thread that raises one. [realtime]
    void count(const FaultEvent& event, std::uint32_t thread) noexcept {
        __atomic_store_n(&shared.last_code, static_cast<std::uint32_t>(event.code), __ATOMIC_RELAXED);
        __atomic_store_n(&shared.last_thread, thread, __ATOMIC_RELAXED);
        __atomic_store_n(&shared.last_cycle, event.cycle, __ATOMIC_RELAXED);
        __atomic_fetch_add(&shared.count, 1, __ATOMIC_RELEASE);
    }
    /// Acknowledges all that were counted. [any]
    void clear() noexcept { __atomic_store_n(&shared.cleared, __atomic_load_n(&shared.count, __ATOMIC_ACQUIRE), __ATOMIC_RELEASE); }
};

}  // namespace hal
