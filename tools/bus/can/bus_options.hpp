// SPDX-License-Identifier: MIT
// Options shared by several commands, with the same help.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "cli/option_set.hpp"
#include "link/address_form.hpp"

namespace hal::tools {

/// Addresses of buses that every program can open, from the table of the drivers:
/// `can:can0, udp:239.74.163.2:43113, ...`.
inline std::string bus_addresses() {
    std::string text;
    for (const auto& form : can::address_forms) {
        if (form.reach != link::Reach::bus) continue;
        if (!text.empty()) text += ", ";
        text += form.example;
    }
    return text;
}

/// For the help of a command that listens.
inline std::string bus_address() {
    return bus_addresses() + " or replay:FILE; with options: ?bitrate=500k&datarate=2M&listen";
}

/// Declares --filter and --count.
inline void declare_filter(OptionSet& set, std::vector<std::string>& filters,
                           std::uint64_t& count) {
    set.values("--filter", filters, "ID[/MASK]",
               "only frames with this identifier, or ID/MASK: 181, 180/780, 18FF0000/1FFF0000; may "
               "be repeated");
    set.value("-n,--count", count, "N", "end after N frames");
}

/// Declares --eds.
inline void declare_eds(
    OptionSet& set, std::string& eds,
    const char* what =
        "device description (EDS, DCF, XDD) with the names and types of the objects") {
    set.value("--eds", eds, "FILE", what);
}

/// Declares --timeout, of one response.
inline void declare_timeout(OptionSet& set, std::int64_t& timeout_ns) {
    set.duration("--timeout", timeout_ns,
                 "timeout of one response before a retry: 1s, 200ms … (default 500ms)");
}

}  // namespace hal::tools
