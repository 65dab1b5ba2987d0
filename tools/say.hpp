// SPDX-License-Identifier: MIT
// How the program speaks when it is not rendering a diagnostic: one line on stderr, beginning with who speaks.
#pragma once

#include <string>
#include <string_view>

#include "options.hpp"

namespace hal::tools {

/// "hal run: SENTENCE" on stderr; returns 1, the exit code that goes with it.
int fail(const Options& options, std::string_view sentence);

/// Writes all of it to a file descriptor; false when the other end is gone or the disk is full.
bool write_all(int descriptor, std::string_view text);

/// Standard output, unbuffered. False when it could not be written; why is said once on stderr, unless the reader has
/// simply left (`| head`).
bool print(std::string_view text);

/// The text of a file ("-": standard input). On failure false, and `text` is the reason.
bool read_file(const std::string& path, std::string& text);

/// Into a file that is made or overwritten. What is wrong, or nothing.
std::string write_file(const std::string& path, std::string_view text);

/// Colours wanted on this descriptor: it is a terminal that is not dumb, and NO_COLOR is not set.
bool colours(int descriptor);

}  // namespace hal::tools
