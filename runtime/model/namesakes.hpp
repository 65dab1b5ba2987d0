// SPDX-License-Identifier: MIT
// Components of other projects that have the name of one of ours.
#pragma once

#include <string>
#include <string_view>

namespace hal {

struct Model;

/// Returns what to type when a pin is unknown because its instance is the namesake of the component
/// that has it; an empty text if it is not. [setup]
std::string namesake_help(const Model& model, std::string_view pin);

}  // namespace hal
