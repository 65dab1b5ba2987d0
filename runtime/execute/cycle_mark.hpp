// SPDX-License-Identifier: MIT
// Where a thread is in its cycle, in memory that a process outside may share
// (machine/report/exit_observer.hpp).
#pragma once

#include <atomic>

#include "plan/plan.hpp"

namespace hal {

/// Written by the thread, read by the supervisor, by crash handlers and by the observer.
struct alignas(64) CycleMark {
    std::atomic<bool> in_function{false};
    const plan::Step* volatile current = nullptr;  ///< the step that runs, or ran last
};

/// Returns the step that the thread is at, or was at last. Of any thread
const plan::Step* newest_step(const CycleMark& mark) noexcept;

}  // namespace hal
