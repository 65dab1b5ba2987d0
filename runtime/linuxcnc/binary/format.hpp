// SPDX-License-Identifier: MIT
// printf's formatting for cycles: glibc's allocates for some conversions, and takes the locale's
// lock for others.
#pragma once

#include <cstdarg>
#include <cstddef>

namespace hal::modules {

/// Does what vsnprintf() does in the C locale, and returns what it returns. Differences: a `long
/// double` is rounded to double; %n stores nothing, %m gives the number of the error, wide
/// characters are '?', and from an argument with a position (%1$d) on the format is copied.
/// [realtime]
int format_text(char* to, std::size_t size, const char* format, va_list arguments) noexcept;

}  // namespace hal::modules
