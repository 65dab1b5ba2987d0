// SPDX-License-Identifier: MIT
// How serious a message is.
#pragma once

#include <cstdint>

namespace hal {

enum class Severity : std::uint8_t { note, warning, error };

}  // namespace hal
