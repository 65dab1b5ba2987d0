// SPDX-License-Identifier: MIT
// `hal can pdo`: the PDOs of a node.
#pragma once

#include <cstdint>
#include <string>

#include "bus/can/bus_options.hpp"

namespace hal::tools {

struct PdoOptions : Options {
    std::string eds;              ///< names and types of the objects
    std::int64_t timeout_ns = 0;  ///< of one response; 0: not given

    void declare(OptionSet& set) override {
        set.words("ADDRESS NODE", "the bus; node ID 1..127");
        declare_eds(set, eds);
        declare_timeout(set, timeout_ns);
    }
};

struct PdoShowOptions : PdoOptions {
    bool json = false;

    void declare(OptionSet& set) override {
        PdoOptions::declare(set);
        set.flag("--json", json, "print JSON, a line per PDO");
    }
};

struct PdoSwitchOptions : PdoOptions {
    void declare(OptionSet& set) override {
        set.words("ADDRESS NODE PDO", "the bus; node ID 1..127; rpdo1 … or tpdo1 …");
        declare_timeout(set, timeout_ns);
    }
};

struct PdoMapOptions : PdoOptions {
    int transmission = -1;  ///< -1, here and below: unchanged
    std::string id;         ///< empty: unchanged
    std::int64_t inhibit_ns = -1;
    std::int64_t event_ns = -1;

    void declare(OptionSet& set) override {
        set.words("ADDRESS NODE PDO OBJECT",
                  "the bus; node ID 1..127; rpdo1 … or tpdo1 …; mapped objects: INDEX:SUB or a "
                  "name, with /BITS if the length is unknown");
        declare_eds(set, eds);
        declare_timeout(set, timeout_ns);
        set.value("--transmission", transmission, "N",
                  "transmission type: 0 SYNC after an event, 1..240 every n-th SYNC, 252, 253 on "
                  "request, 254, 255 on event")
            .in(0, 255);
        set.value("--id", id, "ID", "identifier in hex (default: unchanged)");
        set.duration("--inhibit", inhibit_ns,
                     "TPDO inhibit time, the minimum interval: 1ms, 500us …");
        set.duration("--event", event_ns,
                     "event timer: maximum interval of a TPDO, deadline of an RPDO");
    }
};

struct PdoWatchOptions : PdoShowOptions {
    std::int64_t for_ns = -1;  ///< -1: not given
    std::uint64_t count = 0;   ///< 0: unlimited

    void declare(OptionSet& set) override {
        PdoShowOptions::declare(set);
        set.for_how_long(for_ns, "end after 2s, 500ms … (default: until Ctrl-C)");
        set.value("-n,--count", count, "N", "end after N PDOs");
    }
};

/// `hal can pdo show`. Returns the exit code.
int run_can_pdo_show(const PdoShowOptions&);

/// `hal can pdo map`. Returns the exit code.
int run_can_pdo_map(const PdoMapOptions&);

/// `hal can pdo enable`. Returns the exit code.
int run_can_pdo_enable(const PdoSwitchOptions&);

/// `hal can pdo disable`. Returns the exit code.
int run_can_pdo_disable(const PdoSwitchOptions&);

/// `hal can pdo watch`. Returns the exit code.
int run_can_pdo_watch(const PdoWatchOptions&);

}  // namespace hal::tools
