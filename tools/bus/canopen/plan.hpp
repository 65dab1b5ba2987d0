// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "bus/can/bus_options.hpp"

namespace hal::tools {

struct CanopenPlanOptions : Options {
    std::string cycle, errors, bitrate;
    std::string svg;  ///< a file for the picture; -: standard output; empty: not given
    bool json = false;

    void declare(OptionSet& set) override {
        set.word("FILE",
                 "configuration of the network, NAME.canopen, or a recording: candump's .log, "
                 ".pcapng, .pcap");
        set.value("--errors", errors, "COUNT/TIME",
                  "frames that are disturbed and sent again: COUNT at once, and one more in every "
                  "TIME: 1/10ms");
        set.value("--bitrate", bitrate, "RATE", "bit rate of the bus, for a recording: 500k");
        set.value("--cycle", cycle, "TIME",
                  "period of the master's thread, for a SYNC in every cycle (default 1ms)");
        set.value("--svg", svg, "FILE", "draw the response times to this file; -: standard output");
        set.flag("--json", json, "print JSON");
    }
};

struct CanopenCheckOptions : Options {
    void declare(OptionSet& set) override { set.words("FILE", "configurations, NAME.canopen"); }
};

/// `hal canopen plan`. Returns the exit code.
int run_canopen_plan(const CanopenPlanOptions&);

/// `hal canopen check`. Returns the exit code.
int run_canopen_check(const CanopenCheckOptions&);

}  // namespace hal::tools
