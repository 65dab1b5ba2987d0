// SPDX-License-Identifier: MIT
// The driver basic_cia402 of LinuxCNC's lcec: its parameters, and the PDOs and pins they give.
// Everything here is [setup].
#pragma once

#include <span>

#include "ethercat/config/config_text.hpp"

namespace hal::ethercat::config {

/// Returns the names of the supported parameters.
std::span<const char* const> cia402_parameters();

/// Adds the PDOs and start-up writes of a drive; invalid values are reported in `problems`.
void build_cia402(const std::map<std::string, std::string>& parameters, master::Slave&, SlaveInfo&,
                  std::vector<std::string>& problems);

}  // namespace hal::ethercat::config
