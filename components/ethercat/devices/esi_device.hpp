// SPDX-License-Identifier: MIT
// A device as a description in XML (ESI, ETG.2000) has it: its EEPROM, its object dictionary, its
// PDOs, and what its InitCmds write. Its objects keep the values that are written; behaviour beyond
// that is not in a description.
#pragma once

#include <string>
#include <string_view>

#include "ethercat/devices/io_devices.hpp"
#include "ethercat/esi/esi.hpp"

namespace hal::ethercat::devices {

/// Returns what the emulation of a device leaves out, as in "its mailbox protocol VoE"; empty:
/// nothing. [setup]
std::string not_emulated(const esi::Device&);

/// Makes the device `options.described`, which must be there. [setup]
Parts make_esi_device(const DeviceOptions&);

}  // namespace hal::ethercat::devices
