// SPDX-License-Identifier: MIT
#pragma once

#include <functional>

#include "link/datagram.hpp"

namespace hal::datagram::journal {

/// Opens a port whose results are in the journal of the calling thread, if there is one. [setup]
Opened open_journaled(const std::function<Opened()>& open);

}  // namespace hal::datagram::journal
