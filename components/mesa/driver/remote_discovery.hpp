// SPDX-License-Identifier: MIT
// Finds out which devices are on the smart-serial ports of a card, and what they have.
#pragma once

#include <vector>

#include "mesa/driver/card_image.hpp"
#include "mesa/driver/remote.hpp"

namespace hal::mesa {

/// Stops the ports, asks every used channel, and leaves the ports stopped. Throws CardError when a
/// port does not follow its commands, or a device describes itself in an unknown form. [setup]
std::vector<RemotePort> discover_remotes(SetupLink& link, const CardImage& image,
                                         const ConfigString& config);

}  // namespace hal::mesa
