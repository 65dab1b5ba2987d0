// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace hal::tools {

/// Draws a number, TRUE, FALSE, nan or inf as large as `columns` x `rows` characters allow: with
/// half blocks, or with # without Unicode. Returns the text itself as the only line where it does
/// not fit at all.
std::vector<std::string> big_text(std::string_view text, std::size_t columns, std::size_t rows,
                                  bool unicode);

}  // namespace hal::tools
