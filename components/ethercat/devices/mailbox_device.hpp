// SPDX-License-Identifier: MIT
// A device with every mailbox protocol.
#pragma once

#include "ethercat/devices/io_devices.hpp"

namespace hal::ethercat::devices {

/// Makes a device with all mailbox protocols, BOOT, and 8 bytes of process data that it returns.
Parts make_mailbox_device(const DeviceOptions&);  ///< [setup]

}  // namespace hal::ethercat::devices
