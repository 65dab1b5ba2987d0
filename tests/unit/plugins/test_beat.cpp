// SPDX-License-Identifier: MIT
// Moves the threads' clock by what its pin says, when it leads; tells when its cycle was due.
#include "hal/component.hpp"
#include "hal/discipline.hpp"

namespace {

struct Beat : hal::Component {
    using Component::Component;
    hal::Argument lead{*this, "lead", 1, "0: it only tells the time"};
    hal::In<std::int32_t> step{*this, "step", "per cycle, ns"};
    hal::In<std::int32_t> again{*this, "again", "a second step in the same cycle, ns"};
    hal::Out<std::int64_t> due{*this, "due", "start of the cycle"};
    hal::Out<std::int64_t> shift{*this, "shift", "sum of all steps, after those of this cycle"};
    hal::Out<std::int64_t> limit{*this, "limit", "of the steps of a cycle"};
    hal::Out<std::uint32_t> backwards{*this, "backwards", "cycles that were due before the one before them"};
    hal::Function run{*this, "", &Beat::tell, "steps and tells"};

    void start() {
        if (lead != 0) clock_.claim();
    }
    void tell(hal::Cycle cycle) noexcept {
        if (due != 0 && cycle.start_ns() <= due) backwards = backwards + 1;
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

HAL_COMPONENT(Beat, "test-beat", "Moves the threads' clock")
