// SPDX-License-Identifier: MIT
// Counts its runs and adds up its input: a lost or doubled step shows.
#include "hal/component.hpp"

namespace {

struct Counter : hal::Component {
    using Component::Component;
    hal::In<double> step{*this, "step", "added to sum in each run", {.initial = 1.0}};
    hal::Out<double> sum{*this, "sum", "all steps so far"};
    hal::Out<std::int64_t> count{*this, "count", "runs so far"};
    hal::Out<std::int64_t> twin{*this, "twin", "the same as count, always"};
    hal::Out<double> period{*this, "period", "period passed to the function, ns"};
    hal::Out<bool> on{*this, "on", "TRUE while it runs", {.safe = false}};
    hal::Function run{*this, "", &Counter::advance, "counts"};

    void advance(hal::Cycle cycle) noexcept {
        sum = sum + step;
        count = count + 1;
        twin = count;
        period = static_cast<double>(cycle.period_ns());
        on = true;
    }
};

}  // namespace

HAL_COMPONENT(Counter, "test-counter", "Counts its runs")
