// SPDX-License-Identifier: MIT
// A link of a bus in memory, whose calls are ordered by the journal of the program that uses it.
#pragma once

#include <functional>
#include <string_view>

#include "link/can.hpp"

namespace hal::can::journal {

/// Opens a link of the bus `sim:target` with `open`. Under a journal the order of the calls on the
/// bus is recorded, or repeated. [setup]
Opened open_ordered(std::string_view target, const std::function<Opened()>& open);

}  // namespace hal::can::journal
