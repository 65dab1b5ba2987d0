// SPDX-License-Identifier: MIT
// The control loop that the tests of pid use.
#pragma once

#include <cstdint>

#include "unit/components/component_host.hpp"

namespace hal::test {

/// An enabled loop with all gains 0 and the debug pins.
struct PidLoop : Instance {
    PidLoop() : Instance("pid", {{"debug", "1"}}) {
        set("enable", true);
        set("Pgain", 0.0);
        set("error-previous-target", false);
    }
    /// One cycle; gives the output.
    double step(double command, double feedback, std::int64_t period_ns = 1'000'000) {
        set("command", command);
        set("feedback", feedback);
        run("do-pid-calcs", period_ns);
        return output();
    }
    double output() const { return get<double>("output"); }
    double real(const char* pin) const { return get<double>(pin); }
};

}  // namespace hal::test
