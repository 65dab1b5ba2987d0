// SPDX-License-Identifier: MIT
// What components ask of the C library and nobody computes: the time and random numbers. In a cycle
// with a journal they are noted, and in its re-execution given back. While an instance starts, the
// threads that it creates are counted.
#pragma once

#include <cstddef>

namespace hal {

/// Finds the functions of the C library before the first cycle. [setup]
void prepare_journaled_calls() noexcept;

/// Returns how many threads setup calls of components have created so far. With a sanitizer, which
/// has these functions itself, always 0. [setup]
std::size_t threads_of_components() noexcept;

}  // namespace hal
