// SPDX-License-Identifier: MIT
// An Ethernet port whose results are in the journal of the program that uses it.
#pragma once

#include <functional>

#include "link/ethernet.hpp"

namespace hal::ethernet::journal {

/// Opens a port with `open`. When a journal records, what the port gives its user is recorded; when
/// it is executed again, nothing is opened, and the port gives what was recorded. [setup]
Opened open_journaled(const std::function<Opened()>& open);

}  // namespace hal::ethernet::journal
