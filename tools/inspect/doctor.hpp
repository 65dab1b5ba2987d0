// SPDX-License-Identifier: MIT
#pragma once

#include "cli/option_set.hpp"

namespace hal::tools {

struct DoctorOptions : Options {
    double seconds = 2.0;  ///< of each measurement
    bool json = false;
    bool fix = false;
    bool yes = false;

    void declare(OptionSet& set) override {
        set.value("--seconds", seconds, "S", "duration of each measurement (default 2)")
            .in(0.0, 3600.0);
        set.flag("--json", json, "as JSON");
        set.flag("--fix", fix,
                 "carry out the commands it suggests, each after asking; no measurement");
        set.flag("--yes", yes, "with --fix: without asking");
    }
};

/// Runs `hal doctor`. Returns the exit code.
int run_doctor(const DoctorOptions&);

}  // namespace hal::tools
