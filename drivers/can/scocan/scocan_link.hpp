// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>

#include "link/can.hpp"

namespace hal::can::scocan {

/// Returns true when `key` is an option of this driver and not of every CAN link. [setup]
bool is_own_option(std::string_view key);
/// Returns the names of its own options. [setup]
std::string own_options();

/// Opens `scocan:NODE?slot=N`: the slots of a node of this process. `target` includes the driver's
/// own options. [setup]
Opened open(const std::string& target, const Options&);
/// Describes the link that open() would return, as far as the place determines it. [setup]
Description describe(const std::string& target);

}  // namespace hal::can::scocan
