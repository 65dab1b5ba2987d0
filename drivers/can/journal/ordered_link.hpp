// SPDX-License-Identifier: MIT
// A link of what is in memory, a bus or the queues of a node, whose calls are ordered by the journal
// of the program that uses it.
#pragma once

#include <functional>
#include <string_view>

#include "link/can.hpp"

namespace hal::can::journal {

/// Opens a link with `open`. Under a journal the order of the calls on all links of what `address`
/// names, as in sim:NAME or scocan:NODE, is recorded, or repeated. [setup]
Opened open_ordered(std::string_view address, const std::function<Opened()>& open);

}  // namespace hal::can::journal
