// SPDX-License-Identifier: MIT
// What the sections of a configuration are turned into, and the checks over all of them; for
// config_reader.cpp. [setup]
#pragma once

#include "config_lines.hpp"

namespace hal::canopen::config {

/// Reads [bus].
void read_bus(Keys& keys, MasterConfig& to, Report& report);
/// Reads a line of [messages].
void read_foreign(const Line& line, MasterConfig& to, Report& report);
/// Assigns an identifier to each PDO above 4 that has none: the lowest one that no node uses by the
/// predefined connection set.
void assign_identifiers(MasterConfig& config, Report& report);
/// Derives the configuration date and time (1020h) from what is written to the node: equal writes
/// give equal numbers.
void date_by_content(NodeSetup& node);
/// Checks the rules between nodes: identifiers, numbers of PDOs and SRDOs.
void check_network(const MasterConfig& config, Report& report);

}  // namespace hal::canopen::config
