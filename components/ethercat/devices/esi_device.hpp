// SPDX-License-Identifier: MIT
// A device as a description in XML (ESI, ETG.2000) has it: its EEPROM, its object dictionary, its
// PDOs. Its objects keep the values that are written; behaviour beyond that is not in a
// description.
#pragma once

#include <string>
#include <string_view>

#include "ethercat/devices/io_devices.hpp"
#include "ethercat/esi/esi.hpp"

namespace hal::ethercat::devices {

/// Returns what the emulation cannot do with a device; empty: nothing. [setup]
std::string why_not_emulated(const esi::Device&);

/// Makes the device `options.described`, which must be there. [setup]
Parts make_esi_device(const DeviceOptions&);

}  // namespace hal::ethercat::devices
