// SPDX-License-Identifier: MIT
#include "execute/timeline.hpp"

#include <algorithm>

#include "execute/core.hpp"

namespace hal {
namespace {
constexpr std::int64_t rate_over_ns = 1'000'000'000;
}

Timeline::Timeline() noexcept {
    shared.size = sizeof shared;
    shared.step = [](const hal_clock*, std::int64_t ns) {
        if (Core* const core = Core::current()) {
            core->step_clock(ns);
        }
    };
}

void Timeline::step(std::int64_t grid_ns, std::int64_t ns) noexcept {
    const std::uint32_t newest = newest_.load(std::memory_order_relaxed);
    const Step& last = steps_[newest & 1];
    const bool same_cycle = last.after.load(std::memory_order_relaxed) == grid_ns;
    const std::int64_t shift = last.shift.load(std::memory_order_relaxed);
    const std::int64_t before = same_cycle ? last.before.load(std::memory_order_relaxed) : shift;
    const std::int64_t limit = __atomic_load_n(&shared.limit_ns, __ATOMIC_RELAXED);
    const std::int64_t wanted = std::clamp(ns, -2 * limit, 2 * limit);  // no overflow below
    const std::int64_t now = before + std::clamp(shift - before + wanted, -limit, limit);

    Step& next = steps_[(newest + 1) & 1];
    next.after.store(grid_ns, std::memory_order_release);
    next.before.store(before, std::memory_order_release);
    next.shift.store(now, std::memory_order_release);
    newest_.store(newest + 1, std::memory_order_release);
    __atomic_store_n(&shared.shift_ns, now, __ATOMIC_RELAXED);

    if (!marked_) {
        marked_ = true;
        mark_grid_ns_ = grid_ns;
        mark_shift_ns_ = now;
    } else if (const std::int64_t passed = grid_ns - mark_grid_ns_; passed >= rate_over_ns) {
        rate_.store(static_cast<double>(now - mark_shift_ns_) / static_cast<double>(passed),
                    std::memory_order_relaxed);
        mark_grid_ns_ = grid_ns;
        mark_shift_ns_ = now;
    }
}

}  // namespace hal
