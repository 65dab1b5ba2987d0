// SPDX-License-Identifier: MIT
// `hal doctor --interface NAME --try`: the effect of each setting, measured.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "inspect/interface_settings.hpp"
#include "inspect/round_trip.hpp"

namespace hal::tools {

/// A measurement after a change.
struct TrialStep {
    std::string setting;   ///< that was changed; empty: before the first change
    std::string problem{}; ///< why it was not changed, or empty
    RoundTrip trip{};
};

/// What a trial needs and does.
struct Trial {
    std::string interface;
    std::int64_t duration_ns = 0;       ///< of each measurement
    std::function<bool()> stopped;      ///< returns true to end early
    std::function<void(const TrialStep&)> report;
    std::function<void()> hold;         ///< called while all settings are changed

    /// Measures, changes one setting after the other and measures after each, calls hold(), and
    /// restores all. Returns the settings that could not be restored. `observer` has been made for
    /// the same settings. [setup]
    std::vector<std::string> run(class RestoreObserver& observer,
                                 const std::vector<InterfaceSetting>& settings) const;
};

}  // namespace hal::tools
