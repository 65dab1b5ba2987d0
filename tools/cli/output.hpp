// SPDX-License-Identifier: MIT
// Messages on stderr that begin with the program, text on standard output, whole files.
#pragma once

#include <string>
#include <string_view>

#include "cli/options.hpp"

namespace hal::tools {

/// "hal run: SENTENCE" on stderr; returns 1, the exit code that goes with it.
int fail(const Options& options, std::string_view sentence);

/// Writes all of it to a file descriptor; false when the other end is gone or the disk is full.
bool write_all(int descriptor, std::string_view text);

/// Writes to standard output, unbuffered. Returns false after an error, which is reported once on stderr, unless the reader has
/// simply left (`| head`).
bool print(std::string_view text);

/// The text of a file ("-": standard input). On failure false, and `text` is the reason.
bool read_file(const std::string& path, std::string& text);

/// Creates a file or replaces its content atomically. Returns an error message, or an empty string.
std::string write_file(const std::string& path, std::string_view text);

/// Colours wanted on this descriptor: it is a terminal that is not dumb, and NO_COLOR is not set.
bool colours(int descriptor);

}  // namespace hal::tools
