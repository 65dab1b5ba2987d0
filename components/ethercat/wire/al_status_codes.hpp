// SPDX-License-Identifier: MIT
// Codes of the AL status code register (0134h; ETG.1000.6, table 11; ETG.1020), with the likely
// cause and what to do.
#pragma once

#include <cstdint>

namespace hal::ethercat {

/// What a code means. All texts are fragments without a final stop.
struct AlStatusCode {
    std::uint16_t code;
    const char* text;    ///< what the standard calls it
    const char* cause;   ///< the likely cause
    const char* remedy;  ///< what to do
};

/// Returns the row of a code, or nullptr for an unknown one, such as those of a vendor. [any]
const AlStatusCode* al_status(std::uint16_t code) noexcept;

}  // namespace hal::ethercat
