// SPDX-License-Identifier: MIT
#include <atomic>
#include <cstdint>

#include "hal/component.hpp"
#include "hal/retained.hpp"

namespace {

struct Threadtest : hal::Component {
    using Component::Component;
    hal::Function add{*this, "increment", &Threadtest::increment, "adds 1 to the count"};
    hal::Out<std::uint32_t> count{*this, add, "count",
                                  "runs of increment since the last run of reset"};
    hal::Function clear{*this, "reset", &Threadtest::reset, "sets the count to 0"};

    void increment(hal::Cycle) noexcept {
        count = cleared_.exchange(false, std::memory_order_relaxed) ? 1u : count + 1u;
    }
    void reset(hal::Cycle) noexcept { cleared_.store(true, std::memory_order_relaxed); }

private:
    std::atomic<bool> cleared_{false};  // reset sets it, increment clears it
    hal::Retained retained_{*this, {{"cleared", cleared_}}};
};

}  // namespace

HAL_COMPONENT(Threadtest, "threadtest", "Counts the runs of one thread between those of another",
              R"(
With `increment` in a fast thread and `reset` in a slow one, `count` runs from 1 to the ratio of
their periods. The reset takes effect in the next run of `increment`.

    loadrt threadtest names=ratio
    addf ratio.increment fast
    addf ratio.reset slow
    net runs <= ratio.count
)")
