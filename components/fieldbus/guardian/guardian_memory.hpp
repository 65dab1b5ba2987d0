// SPDX-License-Identifier: MIT
// The memory in which the component and its guardian meet. Every member has one writer; all are
// lock-free atomics.
#pragma once

#include <atomic>
#include <cstdint>

#include "bus/guardian/cycle_counter.hpp"
#include "bus/guardian/start_state.hpp"
#include "bus/guardian/stop_requests.hpp"
#include "fieldbus/guardian/shared_record.hpp"

namespace hal::guardian {

struct GuardianMemory {
    // written by the cycle
    bus::CycleCounter cycles;
    // written by any thread of the runtime
    bus::StopRequests requests;
    // written by the guardian
    alignas(64) SharedRecord record;
    /// StopRequests::Request::count of the last stop that is over: one that follows a guardian that
    /// was killed begins behind it
    std::atomic<std::uint32_t> followed{0};
    std::atomic<std::uint64_t> turns{0};  ///< each waits for at most 5 ms
    bus::StartState start;  ///< and by the component
};

}  // namespace hal::guardian
