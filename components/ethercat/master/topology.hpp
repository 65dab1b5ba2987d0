// SPDX-License-Identifier: MIT
// The tree of the slaves from the ports they use, and the delays along it (facts: a frame takes the
// ports in the order 0, 3, 1, 2).
#pragma once

#include <span>

#include "ethercat/master/bus_slave.hpp"

namespace hal::ethercat::master {

/// Returns whether a port carries frames: loop open and communication, by DL status. [any]
constexpr bool port_in_use(std::uint16_t dl_status, unsigned port) noexcept {
    return (dl_status >> (8 + 2 * port) & 3) == 2;
}

/// Finds parent, ports and neighbours of the slaves along the line. Returns false where the ports
/// do not form a tree. [any]
bool find_tree(std::span<BusSlave* const> line) noexcept;

/// Computes the delay of each slave with a clock, from the reference clock at `reference` along the
/// line, from receive_time. [any]
void find_delays(std::span<BusSlave* const> line, std::size_t reference) noexcept;

}  // namespace hal::ethercat::master
