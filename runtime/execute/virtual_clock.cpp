// SPDX-License-Identifier: MIT
#include "execute/virtual_clock.hpp"

#include "execute/float_modes.hpp"

namespace hal {

void VirtualClock::advance(std::int64_t ns) {
    const std::int64_t end = now_ns_ + ns;
    for (bool ran = false;;) {
        Runner* next = nullptr;
        std::int64_t next_ns = 0;
        for (const auto& runner : runners_) {  // fastest first, so it wins at equal instants
            if (const std::int64_t due = timeline_.due_ns(runner->grid_ns);
                due <= end && (!next || due < next_ns)) {
                next = runner.get();
                next_ns = due;
            }
        }
        if (ran && (!next || next_ns != now_ns_)) {
            background_.run(now_ns_);
        }
        if (!next) break;
        ran = true;
        now_ns_ = next_ns;
        __atomic_fetch_add(&supervisor_.shared.progress, 1, __ATOMIC_RELAXED);
        run(*next);
        next->grid_ns += next->options.period_ns;
    }
    now_ns_ = end;
}

void VirtualClock::run(Runner& runner) {
    const std::int64_t begun_ns = cycle_limit.limit_ns > 0 ? monotonic_ns() : 0;
    {
        const DefaultFloatModes modes;
        runner.core.cycle(runner.grid_ns, now_ns_, now_ns_);
    }
    if (cycle_limit.limit_ns == 0) return;
    const std::int64_t took_ns = monotonic_ns() - begun_ns;
    if (took_ns > cycle_limit.limit_ns) {
        cycle_limit.report(runner.core, took_ns);
    }
}

void VirtualClock::advance_cycles(const Runner& of, std::uint64_t cycles) {
    if (!timeline_.led()) return advance(static_cast<std::int64_t>(cycles) * of.core.period_ns());
    for (; cycles > 0; --cycles) {
        advance(timeline_.due_ns(of.grid_ns) - now_ns_);
    }
}

}  // namespace hal
