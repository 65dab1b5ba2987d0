// SPDX-License-Identifier: MIT
// Adjusts the threads' clock by its pins while it leads, and outputs when its cycle was due.
#include "hal/component.hpp"
#include "hal/discipline.hpp"

namespace {

struct Clock : hal::Component {
    using Component::Component;
    hal::Argument lead{*this, "lead", 1, "0: only outputs the time"};
    hal::In<std::int32_t> step{*this, "step", "adjustment per cycle, ns"};
    hal::In<std::int32_t> again{*this, "again", "second adjustment in the same cycle, ns"};
    hal::Out<std::int64_t> due{*this, "due", "start of the cycle"};
    hal::Out<std::int64_t> shift{*this, "shift",
                                 "sum of all adjustments, including those of this cycle"};
    hal::Out<std::int64_t> limit{*this, "limit", "limit of the adjustments of one cycle"};
    hal::Out<std::uint32_t> backwards{*this, "backwards", "cycles due before their predecessor"};
    hal::Function run{*this, "", &Clock::adjust, "adjusts the clock and outputs its state"};

    void start() {
        if (lead != 0) {
            clock_.claim();
        }
    }
    void adjust(hal::Cycle cycle) noexcept {
        if (due != 0 && cycle.start_ns() <= due) {
            backwards = backwards + 1;
        }
        due = cycle.start_ns();
        clock_.step(step);
        clock_.step(again);
        shift = clock_.shift_ns();
        limit = clock_.limit_ns();
    }

private:
    hal::DisciplinedClock clock_;
};

}  // namespace

HAL_COMPONENT(Clock, "test-clock", "Adjusts the clock of the threads")
