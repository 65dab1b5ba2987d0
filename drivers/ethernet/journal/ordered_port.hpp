// SPDX-License-Identifier: MIT
// A port of a segment in memory, whose calls are ordered by the journal of the program that uses
// it.
#pragma once

#include <functional>
#include <string_view>

#include "link/ethernet.hpp"

namespace hal::ethernet::journal {

/// Opens a port of the segment `sim:NAME` with `open`. Under a journal the order of the calls on the
/// segment is recorded, or repeated. [setup]
Opened open_ordered(std::string_view address, const std::function<Opened()>& open);

}  // namespace hal::ethernet::journal
