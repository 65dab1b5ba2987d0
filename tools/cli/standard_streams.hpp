// SPDX-License-Identifier: MIT
// What becomes of standard output as a whole, for main().
#pragma once

namespace hal::tools {

/// Opens /dev/null in place of standard streams that are closed. Otherwise the next file, socket or device has the descriptor of
/// standard output, and what is printed goes there.
void open_standard_streams();

/// True when print() has lost text that somebody would have read: its disk is full, for one.
bool print_failed();

}  // namespace hal::tools
