// SPDX-License-Identifier: MIT
#include "execute/faults.hpp"

#include "execute/core.hpp"

namespace hal {

FaultBoard::FaultBoard() noexcept {
    shared.size = sizeof shared;
    shared.clear = [](const hal_faults* f) {
        auto* faults = const_cast<hal_faults*>(f);
        __atomic_store_n(&faults->cleared, __atomic_load_n(&faults->count, __ATOMIC_ACQUIRE), __ATOMIC_RELEASE);
    };
    shared.raise = [](const hal_faults*, const void* self, const char* reason, double detail) {
        if (Core* const core = Core::current()) core->raise({HAL_FAULT_COMPONENT, 0, core->cycle_number(), 0, detail, reason, self});
    };
}

}  // namespace hal
