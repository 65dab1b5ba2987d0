// SPDX-License-Identifier: MIT
// Reads device descriptions in XML (XDD), also with a configuration (XDC), CiA 311, into the same
// structures as an EDS.
#pragma once

#include <string_view>

#include "eds.hpp"

namespace hal::canopen::eds {

/// Reads the bytes of an XDD or XDC file. A build without the XML library rejects them with the
/// reason. [setup]
ReadResult read_xdd(std::string_view bytes);

/// Reads XML if the first character that is not blank is <, else an EDS or DCF. [setup]
ReadResult read_description(std::string_view bytes);

}  // namespace hal::canopen::eds
