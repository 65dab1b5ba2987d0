// SPDX-License-Identifier: MIT
// The parts of a netlist that belong to different machines: `node NAME… [rate=TIME]
// [deadline=TIME]` begins the part of these nodes, which ends at the next such line or with the
// file; `node all` begins one of all nodes, as are the lines before the first.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "netlist/netlist.hpp"
#include "netlist/usage.hpp"

namespace hal {

/// A node of a netlist, from its `node` lines.
struct NodeLine {
    std::string name;
    Span at;                       ///< where it is named first
    std::int64_t rate_ns = 0;      ///< send interval of its signals; 0: not set
    /// without them for this time its readers use their safe values; 0: not set
    std::int64_t deadline_ns = 0;
    Span options_at;               ///< of the line that sets them

    std::int64_t rate() const { return rate_ns != 0 ? rate_ns : 10'000'000; }
    /// The default is ten intervals, at least 100 ms: without real-time scheduling a message may be
    /// that late.
    std::int64_t deadline() const {
        if (deadline_ns != 0) return deadline_ns;
        if (rate() < 10'000'000) return 100'000'000;
        return 10 * rate();
    }
};

inline constexpr Usage node_usage{"node", "NAME... [rate=TIME] [deadline=TIME]"};

bool is_node_line(const Command& command);

/// Takes the nodes that the `node` lines of `commands` name into `nodes`, in order of first
/// mention. Reports what is wrong with the lines.
void collect_nodes(const std::vector<Command>& commands, std::vector<NodeLine>& nodes,
                   Diagnostics& diagnostics);

/// Leaves the commands of node `name`: those of its parts and of the parts of all. No `node` line
/// is left.
void keep_part(std::string_view name, std::vector<Command>& commands);

}  // namespace hal
