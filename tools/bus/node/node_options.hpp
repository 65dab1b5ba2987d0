// SPDX-License-Identifier: MIT
// Options of every kind of simulated device, `hal node KIND`.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "bus/can/bus_options.hpp"
#include "cli/option_set.hpp"

namespace hal::tools {

struct NodeOptions : Options {
    std::string link, id;
    bool eds = false;                           ///< print the EDS and end
    std::vector<std::string> faults, settings;  ///< --fault, --set
    std::uint16_t heartbeat_ms = 0;
    std::uint32_t serial = 1;
    bool starts_itself = false;
    std::string tdma, station, tunnel, skew, drift;  ///< of a TDMA station
    std::int64_t for_ns = -1;                        ///< -1: not given

    void declare(OptionSet& set) override {
        set.value("--link", link, "ADDRESS",
                  "the bus: " + bus_addresses() + "; with options: ?bitrate=500k");
        set.value("--id", id, "N",
                  "node ID, 1..127 or 0x..; none: wait for one from an LSS master");
        set.flag("--eds", eds, "print its EDS and end");
        set.values("--fault", faults, "FAULT",
                   "inject a fault: late-sdo, mute:from=5s:for=1s, twice:every=3 …; list: hal node "
                   "faults; may be repeated");
        set.values("--set", settings, "NAME=VALUE",
                   "set a value of the simulated environment: NAME=VALUE, or NAME=VALUE@2s for "
                   "later; may be repeated");
        set.value("--heartbeat", heartbeat_ms, "MS",
                  "initial heartbeat period (1017h) in ms (default 0: off)");
        set.value("--serial", serial, "N", "serial number (default 1)");
        set.flag("--start", starts_itself, "enter operational after boot-up without a master");
        set.value("--tdma", tdma, "FILE",
                  "run as a TDMA station on the interface of --link cane:IF with this schedule; "
                  "auto: received from the master (RTcfg)");
        set.value("--station", station, "NAME",
                  "station name in the schedule (default: the one with the interface's address)");
        set.value("--tunnel", tunnel, "NAME",
                  "create an interface for ordinary packets, sent in slot 1, as in hal0; its "
                  "address is the ip of the schedule");
        set.value("--skew", skew, "PPM",
                  "how much faster its clock runs than that of this machine, as in 200ppm");
        set.value("--drift", drift, "PPM", "change of --skew per second, as in 0.1ppm");
        set.for_how_long(for_ns, "end after 10s, 2min … (default: until Ctrl-C)");
    }
};

}  // namespace hal::tools
