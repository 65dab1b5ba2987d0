// SPDX-License-Identifier: MIT
#pragma once

#include "link/can.hpp"

namespace hal::can::slcan {

/// Opens `slcan:DEVICE`: an adapter on a serial line, or the peer of a pseudo-terminal. [setup]
Opened open(const std::string& device, const Options&);
/// Describes what open() would return, as far as the place determines it. [setup]
Description describe(const std::string& device);

}  // namespace hal::can::slcan
