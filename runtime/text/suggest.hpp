// SPDX-License-Identifier: MIT
// Names that a message offers instead of an unknown one. Everything here is [setup].
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace hal {

/// Returns the names of `candidates` close to `name` (edit distance, prefixes, swapped separators), best first, at most `most`.
std::vector<std::string> similar(std::string_view name, const std::vector<std::string>& candidates, std::size_t most = 3);

/// Returns "did you mean 'x'?" or "did you mean 'x' or 'y'?", or nothing if no candidate is close.
std::string did_you_mean(std::string_view name, const std::vector<std::string>& candidates);

/// Joins names with commas, cut to the width of a line: "a, b, c, … (17 more)".
std::string listed(const std::vector<std::string>& names, std::size_t most = 12);

/// The same, but offers all names if none is close: "did you mean 'x'?" or "KINDS: a, b, c".
std::string suggestion(std::string_view name, const std::vector<std::string>& candidates, std::string_view kinds);

}  // namespace hal
