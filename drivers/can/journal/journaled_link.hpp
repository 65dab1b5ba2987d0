// SPDX-License-Identifier: MIT
// A CAN link whose results are in the journal of the program that uses it.
#pragma once

#include <functional>

#include "link/can.hpp"

namespace hal::can::journal {

/// Opens a link with `open`. When a journal records, what the link gives its user is recorded; when
/// it is executed again, nothing is opened, and the link gives what was recorded. [setup]
Opened open_journaled(const std::function<Opened()>& open);

}  // namespace hal::can::journal
