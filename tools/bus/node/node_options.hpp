// SPDX-License-Identifier: MIT
// What every kind of simulated device takes behind `hal node KIND`.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

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
        set.value("--link", link, "ADDRESS", "the bus: can:can0, udp:GROUP:PORT, slcan:/dev/ttyACM0, cane:enp3s0; options follow: ?bitrate=500k");
        set.value("--id", id, "N", "its node-id, 1-127 or 0x..; none: an LSS master gives it one");
        set.flag("--eds", eds, "print its EDS and end");
        set.values("--fault", faults, "FAULT", "what it does wrong: late-sdo, mute:from=5s:for=1s, twice:every=3 …; list: hal node faults; may be repeated");
        set.values("--set", settings, "NAME=VALUE", "the world around it: NAME=VALUE, or NAME=VALUE@2s for later; may be repeated");
        set.value("--heartbeat", heartbeat_ms, "MS", "ms between heartbeats until a master says otherwise (default 0: none)");
        set.value("--serial", serial, "N", "its serial number (default 1)");
        set.flag("--start", starts_itself, "operational after boot-up without a master");
        set.value("--tdma", tdma, "FILE", "a TDMA station on the interface of --link cane:IF, by this schedule; auto: the master sends it (RTcfg)");
        set.value("--station", station, "NAME", "its name in the schedule (default: the one with the interface's address)");
        set.value("--tunnel", tunnel, "NAME", "an interface for ordinary packets, which leave in slot 1, as in hal0; its address is the schedule's ip");
        set.value("--skew", skew, "PPM", "how much faster its clock is than this machine's, as in 200ppm");
        set.value("--drift", drift, "PPM", "how that changes in a second, as in 0.1ppm");
        set.for_how_long(for_ns, "end after 10s, 2min …; without it: until Ctrl-C");
    }
};

}  // namespace hal::tools
