// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>

#include "link/can.hpp"

namespace hal::can::cane {

/// Whether `key` belongs to this driver rather than to every CAN link. [setup]
bool is_own_option(std::string_view key);
/// "format, order, …". [setup]
std::string own_options();

/// `cane:IF?key=value`: CAN messages in Ethernet frames. `place` has the driver's own options behind it. [setup]
Opened open(const std::string& place, const Options&);
/// Describes what open() would return, as far as the place determines it. [setup]
Description describe(const std::string& place);

}  // namespace hal::can::cane
