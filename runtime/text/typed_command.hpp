// SPDX-License-Identifier: MIT
// Commands in messages, as the user has to type them.
#pragma once

#include <string>
#include <string_view>

namespace hal {

/// Returns `text` with each command `hal NAME …` as the user started this program: `./hal NAME …`
/// where HALCYON_STARTED_AS, which the script `hal` of a clone sets, is "./hal". [setup]
std::string as_typed(std::string_view text);

/// Returns how the user started this program: "hal", or what HALCYON_STARTED_AS is. [setup]
std::string started_as();

}  // namespace hal
