// SPDX-License-Identifier: MIT
// Messages on stderr that begin with the program, text on standard output, whole files.
#pragma once

#include <string>
#include <string_view>

#include "cli/options.hpp"

namespace hal::tools {

/// Prints "hal run: SENTENCE" on stderr; returns 1, the exit code.
int fail(const Options& options, std::string_view sentence);

/// Writes all of the text to a file descriptor. Returns false when the other end is closed or the
/// disk is full.
bool write_all(int descriptor, std::string_view text);

/// Writes to standard output, unbuffered. Returns false after an error, which is reported once on
/// stderr, unless the reader has closed the pipe (`| head`).
bool print(std::string_view text);

/// Returns the exit code of a command. [any]
constexpr int exit_code(bool success) { return success ? 0 : 1; }

/// Reads a text file ("-": standard input). On failure returns false and sets `text` to the reason.
bool read_file(const std::string& path, std::string& text);

/// Creates a file or replaces its content atomically. Returns an error message, or an empty string.
std::string write_file(const std::string& path, std::string_view text);

/// Returns true when output on this descriptor is coloured: a terminal other than `dumb`, and
/// NO_COLOR is not set.
bool colours(int descriptor);

}  // namespace hal::tools
