// SPDX-License-Identifier: MIT
// Converts a device description to the entries of an object dictionary.
#pragma once

#include "canopen/protocol/description.hpp"
#include "eds.hpp"

namespace hal::canopen::eds {

/// Returns the entries of the device with their values at power-on: the defaults or, with
/// `configured`, the parameter values of a DCF. Values with `$NODEID` stay relative to the node ID.
/// Entries of unknown data types and type definitions are omitted. [setup]
Description dictionary_of(const DeviceDescription& device, bool configured = false);

}  // namespace hal::canopen::eds
