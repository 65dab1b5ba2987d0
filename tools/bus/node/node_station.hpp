// SPDX-License-Identifier: MIT
// A device whose loop runs in a time slot of a segment.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "bus/node/node_options.hpp"
#include "hal/message_log.hpp"

namespace hal::tools {

class NodeStation {
public:
    virtual ~NodeStation() = default;
    /// Turns until `turn` returns false: once a cycle, shortly before the slot, with the time of
    /// the station's clock. Prints the events of the segment on standard error.
    virtual void run(const std::function<bool(std::int64_t local_ns, bool synchronous)>& turn) = 0;
    virtual std::string summary() const = 0;  ///< Returns a line with the statistics of the cycles.
};

/// Creates the station named by options and schedule on the interface of the link, and offers its
/// slots to `cane:` links. Adds its slot to `link` if it names none. With `--tdma auto` it waits
/// for the schedule from the master and calls `ended` every few milliseconds to see whether to give
/// up. `prefix` begins each line about the segment. Returns the problem, or "": in a build without
/// TDMA, that it is left out. [setup]
std::string make_tdma_station(const NodeOptions&, std::string& link, const hal::LinePrefix& prefix,
                              const std::function<bool()>& ended,
                              std::unique_ptr<NodeStation>& made);

}  // namespace hal::tools
