// SPDX-License-Identifier: MIT
// Safety over EtherCAT (FSoE) in LinuxCNC's format: a logic terminal names its safe terminals by
// `fsoeSlaveIdx`, and the master copies the safety frames between them. The master neither reads
// nor computes a frame: the terminals check them by CRC and watchdog. Everything here is [setup].
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "ethercat/config/config_text.hpp"

namespace hal::ethercat::config {

/// The modParams of a logic terminal, in the order of the file.
using FsoeParameters = std::vector<std::pair<std::string, std::string>>;

/// Adds the process data, the pins and the copied frames of the logic terminal `logic` of a bus.
/// Problems are sentences.
void build_fsoe_logic(Bus& bus, std::size_t logic, const FsoeParameters& parameters,
                      std::vector<std::string>& problems);

}  // namespace hal::ethercat::config
