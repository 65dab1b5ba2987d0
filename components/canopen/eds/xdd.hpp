// SPDX-License-Identifier: MIT
// Device descriptions in XML (XDD) and with a configuration (XDC), CiA 311: read into what an EDS is read into.
#pragma once

#include <string_view>

#include "eds.hpp"

namespace hal::canopen::eds {

/// Reads the bytes of an XDD or XDC file; refuses with the reason when this build has no XML library. [any, not real time]
Reading read_xdd(std::string_view bytes);

/// By the first character that counts: XML, or else an EDS or DCF.
Reading read_description(std::string_view bytes);

}  // namespace hal::canopen::eds
