// SPDX-License-Identifier: MIT
// The description of a device as an EDS, so that a master can be configured from it.
#pragma once

#include "canopen/eds/eds.hpp"
#include "canopen/protocol/description.hpp"

namespace hal::canopen {

/// Everything `d` says, in the structures of CiA 306; eds::write_eds() makes the text, eds::dictionary_of() leads back. Names of the
/// file, vendor and dates are the caller's to fill in. [any, not real time]
eds::DeviceDescription eds_of(const Description& d);

/// What CiA 301, 302, 401, 402 and 404 call an object that has sub-indices, or "Object 2000h". [any, not real time]
std::string object_name(const Description& d, std::uint16_t index);

}  // namespace hal::canopen
