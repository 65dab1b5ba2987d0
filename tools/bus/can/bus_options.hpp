// SPDX-License-Identifier: MIT
// Options that several commands of a bus have, in the same words.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "cli/option_set.hpp"

namespace hal::tools {

inline constexpr const char* bus_address =
    "can:can0, udp:GROUP:PORT, slcan:/dev/ttyACM0, cane:enp3s0 or replay:FILE; options follow: ?bitrate=500k&datarate=2M&listen";

/// Declares --filter and --count.
inline void declare_filter(OptionSet& set, std::vector<std::string>& filters, std::uint64_t& count) {
    set.values("--filter", filters, "ID[/MASK]", "only frames with this identifier, or ID/MASK: 181, 180/780, 18FF0000/1FFF0000; may be repeated");
    set.value("-n,--count", count, "N", "end after so many frames");
}

/// Declares --eds.
inline void declare_eds(OptionSet& set, std::string& eds, const char* what = "names and types of the node's objects: an EDS, DCF or XDD file") {
    set.value("--eds", eds, "FILE", what);
}

/// Declares --timeout of one answer.
inline void declare_timeout(OptionSet& set, std::int64_t& timeout_ns) {
    set.duration("--timeout", timeout_ns, "an answer comes within 1s, 200ms … (default 500ms); then it is asked again");
}

}  // namespace hal::tools
