// SPDX-License-Identifier: MIT
// Exports the description of a device as an EDS, to configure a master with it.
#pragma once

#include "canopen/eds/eds.hpp"
#include "canopen/protocol/description.hpp"

namespace hal::canopen {

/// Returns `d` in the structures of CiA 306. eds::write_eds() formats it, eds::dictionary_of() is
/// the inverse. File name, vendor and dates are left for the caller to fill in. [any, not real
/// time]
eds::DeviceDescription eds_of(const Description& d);

/// Returns the name of an object with sub-indices as CiA 301, 302, 401, 402 and 404 have it, or
/// "Object 2000h". [any, not real time]
std::string object_name(const Description& d, std::uint16_t index);

}  // namespace hal::canopen
