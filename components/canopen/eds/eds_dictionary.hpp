// SPDX-License-Identifier: MIT
// From a device description to what an object dictionary is made of.
#pragma once

#include "canopen/protocol/description.hpp"
#include "eds.hpp"

namespace hal::canopen::eds {

/// The entries of the device with their values at power-on: the defaults or, with `configured`, the parameter values of a DCF where it
/// has some. Values with `$NODEID` stay relative to the node-id. Entries whose data type is not known, and the definitions of types, are
/// left out. [setup]
Description dictionary_of(const DeviceDescription& device, bool configured = false);

}  // namespace hal::canopen::eds
