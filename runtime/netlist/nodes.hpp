// SPDX-License-Identifier: MIT
// The parts of a netlist that belong to different machines: `node NAME… [rate=TIME] [deadline=TIME]` begins the part of these nodes, which
// ends at the next such line or with the file; `node all` begins one of all nodes, as are the lines before the first.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "netlist/netlist.hpp"
#include "netlist/usage.hpp"

namespace hal {

/// What a `node` line says of a node.
struct NodeLine {
    std::string name;
    Span at;                       ///< where it is named first
    std::int64_t rate_ns = 0;      ///< from one sending of its signals to the next; 0: not said
    std::int64_t deadline_ns = 0;  ///< after so long without them its readers take their safe values; 0: not said
    Span options_at;               ///< of the line that says so

    std::int64_t rate() const { return rate_ns != 0 ? rate_ns : 10'000'000; }
    /// Not said: ten sendings, at least 100 ms: a machine that is not real time may be late for so long.
    std::int64_t deadline() const { return deadline_ns != 0 ? deadline_ns : rate() < 10'000'000 ? 100'000'000 : 10 * rate(); }
};

inline constexpr Usage node_usage{"node", "NAME... [rate=TIME] [deadline=TIME]"};

bool is_node_line(const Command& command);

/// Takes the nodes that the `node` lines of `commands` name into `nodes`, in order of first mention. Reports what is wrong with the lines.
void collect_nodes(const std::vector<Command>& commands, std::vector<NodeLine>& nodes, Diagnostics& diagnostics);

/// Leaves the commands of node `name`: those of its parts and of the parts of all. No `node` line is left.
void keep_part(std::string_view name, std::vector<Command>& commands);

}  // namespace hal
