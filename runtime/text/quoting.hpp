// SPDX-License-Identifier: MIT
// How messages name and count things.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace hal {

/// 'pid.0.output'. [setup]
inline std::string quoted(std::string_view name) { return "'" + std::string(name) + "'"; }

/// "1 pin", "3 pins". [setup]
inline std::string counted(std::size_t number, std::string_view noun) {
    return std::to_string(number) + " " + std::string(noun) + (number == 1 ? "" : "s");
}

}  // namespace hal
