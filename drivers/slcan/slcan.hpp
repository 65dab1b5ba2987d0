// SPDX-License-Identifier: MIT
#pragma once

#include "link/can.hpp"

namespace hal::can::slcan {

/// `slcan:DEVICE`: an adapter on a serial line, or whoever is at the other end of a pseudo-terminal. [setup]
Opened open(const std::string& device, const Options&);

}  // namespace hal::can::slcan
