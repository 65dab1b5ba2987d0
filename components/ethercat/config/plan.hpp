// SPDX-License-Identifier: MIT
// What a bus needs of the time of a cycle: frames and their datagrams as the master sends them,
// wire time at 100 Mbit/s, latency.
#pragma once

#include <string>
#include <vector>

#include "ethercat/config/config.hpp"

namespace hal::ethercat::config {

/// Assumptions of the plan.
struct PlanOptions {
    std::int64_t slave_delay_ns = 1000;   ///< a frame's way through a slave and back
    /// from the start of the cycle until the last frame is sent, worst case
    std::int64_t master_ns = 100'000;
    std::int64_t drive_ns = 0;  ///< SYNC0 to output in the slave; 0: unknown, not counted
    std::size_t acyclic_frame_bytes = 60;  ///< the frame of a cycle for states and mailboxes
};

struct PlannedDatagram {
    std::string command;  ///< "LRW", "FRMW", …
    std::string domain;  ///< empty: the system time
    std::size_t data_bytes = 0;
    std::size_t output_bytes = 0;
    std::size_t input_bytes = 0;
    std::size_t mailbox_states = 0;
    unsigned expected_wkc = 0;
};

struct PlannedFrame {
    unsigned every = 1;  ///< sent in every n-th cycle
    std::size_t bytes = 0;  ///< without check sequence
    std::int64_t wire_ns = 0;  ///< with preamble, check sequence and gap
    std::vector<PlannedDatagram> datagrams;
};

/// Cycles in which the same frames are sent. The pattern repeats after Plan::period cycles.
struct PlannedSlot {
    std::vector<unsigned> cycles;  ///< from 0
    std::vector<std::size_t> frames;  ///< numbers of cyclic frames
    std::int64_t wire_ns = 0;  ///< with the acyclic frame
};

/// The longest way from an input of one domain to an output of another one.
struct PlannedTrip {
    std::string from, to;  ///< domains
    unsigned cycles = 0;
    bool synchronised = false;  ///< inputs are taken and outputs act at SYNC0
    std::int64_t worst_ns = 0;
};

struct Plan {
    std::vector<PlannedFrame> cyclic;
    std::vector<PlannedSlot> slots;
    std::vector<PlannedTrip> trips;
    unsigned period = 1;  ///< cycles
    /// of the longest cycle, with the acyclic frame; without check sequence
    std::size_t frames = 0;
    std::size_t frame_bytes = 0;
    /// sending them; through all slaves and back
    std::int64_t wire_ns = 0;
    std::int64_t propagation_ns = 0;
    std::int64_t cycle_ns = 0;
    double load = 0;  ///< wire time per cycle time
    std::int64_t shortest_cycle_ns = 0;  ///< wire time, propagation and master
    std::int64_t input_to_output_ns = 0;  ///< of the longest trip
    bool fits = true;
    std::string text;  ///< the arithmetic, a line each
};

/// Computes the plan of a bus. [setup]
Plan plan(const Bus&, const PlanOptions& = {});

}  // namespace hal::ethercat::config
