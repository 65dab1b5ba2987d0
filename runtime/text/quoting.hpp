// SPDX-License-Identifier: MIT
// How messages name and count things.
#pragma once

#include <concepts>
#include <string>
#include <string_view>

namespace hal {

/// 'pid.0.output'. [setup]
inline std::string quoted(std::string_view name) { return "'" + std::string(name) + "'"; }

/// "1 entry", "3 entries". [setup]
std::string counted(std::integral auto number, std::string_view one, std::string_view many) {
    return std::to_string(number) + " " + std::string(number == 1 ? one : many);
}
/// "1 pin", "3 pins". [setup]
std::string counted(std::integral auto number, std::string_view noun) {
    return counted(number, noun, std::string(noun) + "s");
}

/// Appends an item to a list such as "a, b". [setup]
inline void append_item(std::string& list, std::string_view item,
                        std::string_view separator = ", ") {
    list.append(list.empty() ? "" : separator).append(item);
}

}  // namespace hal
