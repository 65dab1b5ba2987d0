// SPDX-License-Identifier: MIT
// What must hold whatever comes in.
#pragma once

#include <cstdio>
#include <cstdlib>
#include <string_view>

namespace hal::fuzz {

/// Prints the violated property to stderr, with the part of the input that shows it, and aborts:
/// libFuzzer keeps that input.
inline void require(bool holds, const char* what, std::string_view input = "") {
    if (holds) return;
    std::fprintf(stderr, "broken: %s\n%.*s\n", what, static_cast<int>(input.size()),
                 input.empty() ? "" : input.data());
    std::abort();
}

}  // namespace hal::fuzz
