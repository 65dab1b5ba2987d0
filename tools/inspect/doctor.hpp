// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "cli/option_set.hpp"

namespace hal::tools {

struct DoctorOptions : Options {
    double seconds = 2.0;  ///< of each measurement
    bool json = false;
    bool fix = false;
    bool yes = false;
    std::string interface{};  ///< examine this network interface instead of the machine
    int cpu = -1;             ///< of the thread that uses the interface; -1: the isolated ones
    bool udp = false;         ///< the interface leads to a card that is reached by IP
    bool trial = false;
    bool hold = false;

    void declare(OptionSet& set) override {
        set.value("--seconds", seconds, "S", "duration of each measurement (default 2)")
            .in(0.0, 3600.0);
        set.flag("--json", json, "as JSON");
        set.flag("--fix", fix,
                 "carry out the commands it suggests, each after asking; no measurement");
        set.flag("--yes", yes, "with --fix: without asking");
        set.value("--interface", interface, "NAME",
                  "examine this network interface for EtherCAT or raw Ethernet, and measure the "
                  "round trip of frames");
        set.value("--cpu", cpu, "N",
                  "with --interface: CPU of the thread that uses it (default: the isolated ones)")
            .in(0, 4095);
        set.flag("--udp", udp,
                 "with --interface: for a card that is reached by IP, such as Mesa's: an IP address "
                 "belongs there, and no frame is sent");
        set.flag("--try", trial, "with --interface: change each setting, measure, and restore all");
        set.flag("--hold", hold, "with --try: keep the changes until Ctrl-C");
    }
};

/// Runs `hal doctor`. Returns the exit code.
int run_doctor(const DoctorOptions&);

}  // namespace hal::tools
