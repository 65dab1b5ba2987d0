// SPDX-License-Identifier: MIT
// The table behind codes.hpp: a row per diagnostic code, sorted by name. `page` is what `hal explain CODE` prints:
// what it means, why it is refused, what to do; an example where it helps. tests/errors/<name>.hal provokes it.
#pragma once

namespace hal {

struct CodePage {
    const char* name;
    const char* page;
};

inline constexpr CodePage code_pages[] = {
    {"two-writers",
     "A signal has one writer: one OUT pin, or any number of I/O pins, never both. A second output on the same signal "
     "would make its value depend on the order of functions.\n\nJoin two sources with sum2, or2 or mux2, or unlink the first one with unlinkp."},
};

}  // namespace hal
