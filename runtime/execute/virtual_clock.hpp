// SPDX-License-Identifier: MIT
// The clock of `hal sim`: advances from one due cycle to the next and runs each on the caller's
// thread.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "execute/background.hpp"
#include "execute/runner.hpp"
#include "execute/supervisor.hpp"
#include "execute/timeline.hpp"

namespace hal {

/// Of all virtual clocks of the process: `report` is called after each cycle that took longer than
/// `limit_ns` of wall time; 0: none.
struct CycleLimit {
    std::int64_t limit_ns = 0;
    void (*report)(const Core& core, std::int64_t took_ns) = nullptr;
};

/// [setup] throughout. What it is given must outlive it.
class VirtualClock {
public:
    /// `runners`: fastest first, so that the fastest runs first at equal instants.
    VirtualClock(const std::vector<std::unique_ptr<Runner>>& runners, const Timeline& timeline,
                 Background& background, Supervisor& supervisor)
        : runners_(runners),
          timeline_(timeline),
          background_(background),
          supervisor_(supervisor) {}

    std::int64_t now_ns() const { return now_ns_; }
    inline static CycleLimit cycle_limit;  ///< set before the first cycle
    /// Runs every cycle due within the next `ns`.
    void advance(std::int64_t ns);
    /// Runs until `of` has finished this many more cycles, with all other cycles that are due until
    /// then.
    void advance_cycles(const Runner& of, std::uint64_t cycles);

private:
    const std::vector<std::unique_ptr<Runner>>& runners_;
    const Timeline& timeline_;
    Background& background_;
    Supervisor& supervisor_;
    void run(Runner& runner);
    std::int64_t now_ns_ = 0;
};

}  // namespace hal
