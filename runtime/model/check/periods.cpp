// SPDX-License-Identifier: MIT
#include "model/check/check.hpp"

namespace hal {

void check_periods(const Model& model, Diagnostics& diagnostics) {
    if (model.threads.empty()) return;
    const Thread& fastest = *model.threads.front();
    const std::int64_t base = fastest.options.period_ns;
    for (const auto& thread : model.threads) {
        const std::int64_t period = thread->options.period_ns;
        if (period % base == 0) continue;
        const std::int64_t lower = period / base * base;
        Diagnostic d{Severity::error,
                     "period-multiple",
                     "the period of thread '" + thread->name + "' (" + std::to_string(period) +
                         " ns) is not a multiple of the fastest thread's (" + fastest.name + ", " +
                         std::to_string(base) + " ns)",
                     {{thread->made, ""}},
                     {}};
        if (fastest.made.known()) {
            d.labels.push_back({fastest.made, "fastest thread"});
        }
        d.help.push_back("use " + std::to_string(lower) + " or " + std::to_string(lower + base));
        diagnostics.add(std::move(d));
    }
}

}  // namespace hal
