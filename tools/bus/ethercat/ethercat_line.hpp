// SPDX-License-Identifier: MIT
// `hal node ethercat`: a line of emulated EtherCAT slaves as a process, on a real interface.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "cli/option_set.hpp"

namespace hal::tools {

struct EthercatLineOptions : Options {
    std::string link, backup;
    std::int64_t for_ns = -1;  ///< -1: not given
    std::vector<std::string> faults;

    void declare(OptionSet& set) override {
        set.words(
            "FILE",
            "the devices of the line, one per line: coupler, servo axes=2, digital_in bits=16 …");
        set.value("--link", link, "ADDRESS",
                  "link of the first slave to the master: eth:enp3s0, or udp:127.0.0.1 without "
                  "privileges");
        set.value("--backup", backup, "ADDRESS",
                  "link of the last slave to the second port of the master, which closes a ring: "
                  "eth:enp4s0, udp:127.0.0.1:34981");
        set.values("--fault", faults, "FAULT",
                   "inject a fault at slave N: N:corrupt-every=9, N:lose-every=9, "
                   "N:double-every=9, N:noise-every=9, N:drift=20 (ppm); may be repeated");
        set.for_how_long(for_ns, "end after 10s, 2min … (default: until Ctrl-C)");
    }
};

/// Serves the line until a signal or the end of --for. Returns the exit code.
int run_node_ethercat(const EthercatLineOptions&);

}  // namespace hal::tools
