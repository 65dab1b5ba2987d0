// SPDX-License-Identifier: MIT
#include "execute/faults.hpp"

#include <algorithm>
#include <functional>
#include <type_traits>

#include "execute/core.hpp"

namespace hal {
namespace {

static_assert(std::is_standard_layout_v<FaultBoard>);  // its address is that of `shared`

FaultBoard& board_of(const hal_faults* shared) noexcept {
    return *reinterpret_cast<FaultBoard*>(const_cast<hal_faults*>(shared));
}

}  // namespace

FaultBoard::FaultBoard() noexcept {
    shared.faults.size = sizeof shared;
    shared.faults.clear = [](const hal_faults* f) { board_of(f).clear(); };
    shared.faults.raise = [](const hal_faults* f, const void* self, const char* reason,
                             double detail) {
        if (Core* const core = Core::current()) {
            core->raise({HAL_FAULT_COMPONENT, 0, core->cycle_number(), 0, detail, reason, self});
        } else {
            board_of(f).count_outside_cycle();
        }
    };
    shared.lasts = [](const hal_faults* f, const void* self, const char* reason, bool lasts) {
        if (lasts) {
            board_of(f).begin(self, reason);
        } else {
            board_of(f).end(self, reason);
        }
    };
}

// A condition that begins meanwhile is in `lasting` before it is in `count`: then one fault more
// than necessary is kept.
void FaultBoard::clear() noexcept {
    const std::uint64_t counted = __atomic_load_n(&shared.faults.count, __ATOMIC_ACQUIRE);
    const std::uint64_t kept =
        std::min(counted, __atomic_load_n(&shared.lasting, __ATOMIC_ACQUIRE));
    const std::uint64_t before = __atomic_load_n(&shared.faults.cleared, __ATOMIC_ACQUIRE);
    __atomic_store_n(&shared.faults.cleared, std::max(before, counted - kept), __ATOMIC_RELEASE);
}

void FaultBoard::begin(const void* owner, const void* key) noexcept {
    if (lasts(owner, key)) return;
    for (std::size_t i = 0; i < max_lasting; ++i) {
        const void* none = nullptr;
        if (lasting[i].owner.load(std::memory_order_relaxed) != nullptr) continue;
        if (!lasting[i].owner.compare_exchange_strong(none, owner, std::memory_order_acq_rel)) {
            continue;
        }
        __atomic_fetch_add(&shared.lasting, 1, __ATOMIC_RELEASE);
        std::size_t end = lasting_end.load(std::memory_order_relaxed);
        while (end <= i &&
               !lasting_end.compare_exchange_weak(end, i + 1, std::memory_order_acq_rel)) {
        }
        lasting[i].key.store(key, std::memory_order_release);
        return;
    }
}

void FaultBoard::end(const void* owner, const void* key) noexcept {
    const std::size_t used = lasting_end.load(std::memory_order_acquire);
    for (std::size_t i = 0; i < used; ++i) {
        if (lasting[i].key.load(std::memory_order_acquire) != key ||
            lasting[i].owner.load(std::memory_order_acquire) != owner) {
            continue;
        }
        const void* expected = key;
        if (!lasting[i].key.compare_exchange_strong(expected, nullptr, std::memory_order_acq_rel)) {
            continue;
        }
        lasting[i].owner.store(nullptr, std::memory_order_release);
        __atomic_fetch_sub(&shared.lasting, 1, __ATOMIC_RELEASE);
    }
}

void FaultBoard::end_all(const void* first, const void* last) noexcept {
    const std::less<> before;
    const std::size_t used = lasting_end.load(std::memory_order_acquire);
    for (std::size_t i = 0; i < used; ++i) {
        const void* const key = lasting[i].key.load(std::memory_order_acquire);
        const void* const owner = lasting[i].owner.load(std::memory_order_acquire);
        if (key != nullptr && owner != nullptr && !before(owner, first) && before(owner, last)) {
            end(owner, key);
        }
    }
}

bool FaultBoard::lasts(const void* owner, const void* key) const noexcept {
    const std::size_t used = lasting_end.load(std::memory_order_acquire);
    for (std::size_t i = 0; i < used; ++i) {
        if (lasting[i].key.load(std::memory_order_acquire) == key &&
            lasting[i].owner.load(std::memory_order_acquire) == owner) {
            return key != nullptr;
        }
    }
    return false;
}

}  // namespace hal
