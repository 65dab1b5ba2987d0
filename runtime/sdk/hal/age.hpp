// SPDX-License-Identifier: MIT
// The age of a value that comes from elsewhere.
#pragma once

#include <limits>

namespace hal {

/// The age of a value that was never received, and of any value while the thread that shows it is
/// stopped: it is above every limit.
inline constexpr double infinite_age = std::numeric_limits<double>::infinity();

}  // namespace hal
