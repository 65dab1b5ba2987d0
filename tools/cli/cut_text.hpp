// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace hal::tools {

/// Returns the beginning of a text that fits into `width` terminal columns, as printable() shows it.
std::string cut_text(std::string_view text, std::size_t width);

/// The same, filled with blanks to `width` columns.
std::string fit_text(std::string_view text, std::size_t width);

}  // namespace hal::tools
