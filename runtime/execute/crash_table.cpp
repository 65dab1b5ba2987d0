// SPDX-License-Identifier: MIT
#include "execute/crash_table.hpp"

#include <atomic>
#include <cstddef>
#include <mutex>

#include "execute/core.hpp"
#include "execute/cycle_now.hpp"

namespace hal {
namespace {

// A fixed table, so that nothing is walked that may be changing.
constexpr std::size_t max_listed = 256;
std::atomic<Core*> listed_cores[max_listed];

std::mutex cycle_now_mutex;  // cores and plans that cycle_now() reads do not go meanwhile

}  // namespace

void list_core(Core& core) noexcept {
    for (auto& place : listed_cores) {
        Core* empty = nullptr;
        if (place.compare_exchange_strong(empty, &core)) return;
    }
}

void unlist_core(const Core& core) {
    const std::lock_guard lock(cycle_now_mutex);
    for (auto& place : listed_cores) {
        Core* expected = const_cast<Core*>(&core);
        if (place.compare_exchange_strong(expected, nullptr)) return;
    }
}

Core* core_in_cycle() noexcept {
    for (auto& place : listed_cores) {
        if (Core* const core = place.load(std::memory_order_acquire); core && core->in_function()) {
            return core;
        }
    }
    return nullptr;
}

CycleNow cycle_now() {
    const std::lock_guard lock(cycle_now_mutex);
    if (const Core* const core = core_in_cycle()) {
        return {core, core->monitor.cycles(), core->interrupted_function()};
    }
    return {};
}

void fence_cycle_now() { const std::lock_guard lock(cycle_now_mutex); }

void make_all_safe() noexcept {
    for (auto& place : listed_cores) {
        if (Core* const core = place.load(std::memory_order_acquire)) {
            core->make_safe();
        }
    }
}

}  // namespace hal
