// SPDX-License-Identifier: MIT
// Set-up and final check of the standard streams, for main().
#pragma once

namespace hal::tools {

/// Opens /dev/null in place of standard streams that are closed. Otherwise the next file, socket or
/// device has the descriptor of standard output, and what is printed goes there.
void open_standard_streams();

/// Returns true when print() has lost output with a live reader, on a full disk for instance.
bool print_failed();

}  // namespace hal::tools
