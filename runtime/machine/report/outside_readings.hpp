// SPDX-License-Identifier: MIT
// Finds functions that read sockets and files in their cycle, past the links that a journal has.
#pragma once

namespace hal {

/// From now on such a function is a fault that names it (violation::read_outside). With a
/// sanitizer, which has these functions of the C library itself, nothing is found. [setup]
void report_outside_readings() noexcept;

}  // namespace hal
