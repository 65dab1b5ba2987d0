// SPDX-License-Identifier: MIT
// The drives of CiA 402 of LinuxCNC's lcec (basic_cia402, and devices of the table): their
// parameters, and the PDOs, pins and start-up writes they give.
// Everything here is [setup].
#pragma once

#include <string>
#include <vector>

#include "ethercat/config/config_text.hpp"

namespace hal::ethercat::config {

/// Returns the names of the supported parameters; those of an axis also as `ch1NAME`.
std::vector<std::string> cia402_parameters();

/// Adds the PDOs and start-up writes of a drive; invalid values are reported in `problems`.
void build_cia402(const std::map<std::string, std::string>& parameters, master::Slave&, SlaveInfo&,
                  std::vector<std::string>& problems);

}  // namespace hal::ethercat::config
