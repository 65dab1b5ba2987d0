// SPDX-License-Identifier: MIT
// What a bus needs of the time of a cycle: frames, wire time at 100 Mbit/s, latency.
#pragma once

#include <string>
#include <vector>

#include "ethercat/config/config.hpp"

namespace hal::ethercat::config {

/// Assumptions of the plan.
struct PlanOptions {
    std::int64_t slave_delay_ns = 1000;   ///< a frame's way through a slave and back
    std::int64_t master_ns = 100'000;     ///< from the start of the cycle until the last frame is sent, worst case
    std::int64_t drive_ns = 0;            ///< SYNC0 to output in the slave; 0: unknown, not counted
};

struct PlannedDatagram {
    std::string domain;
    unsigned    every = 1;
    std::size_t output_bytes = 0, input_bytes = 0;
    bool        lrw = true;
    unsigned    expected_wkc = 0;
};

struct Plan {
    std::vector<PlannedDatagram> domains;
    std::size_t                  frames = 0, frame_bytes = 0;  ///< of a cycle in which all domains are exchanged; without check sequence
    std::int64_t                 wire_ns = 0, propagation_ns = 0;  ///< sending all frames; through all slaves and back
    std::int64_t                 cycle_ns = 0;
    double                       load = 0;  ///< wire time per cycle time
    std::int64_t                 shortest_cycle_ns = 0;  ///< wire time, propagation and master
    std::int64_t                 input_to_output_ns = 0;  ///< worst case: from an input change to the output that answers it
    bool                         fits = true;
    std::string                  text;  ///< the arithmetic, a line each
};

/// Computes the plan of a bus. [setup]
Plan plan(const Bus&, const PlanOptions& = {});

}  // namespace hal::ethercat::config
