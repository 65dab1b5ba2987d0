// SPDX-License-Identifier: MIT
// What a component got from outside while it was constructed, started or stopped.
#pragma once

#include <string>

namespace hal {

/// The results of one call, in the order in which it asked for them.
struct SetupResults {
    std::string call;      ///< instance and kind of the call: "x-pid start"
    std::string links;     ///< results of links, and tickets of ordered calls
    std::string readings;  ///< of clocks, 8 bytes each, little-endian

    bool operator==(const SetupResults&) const = default;
};

/// A file that such a call opened to read it.
struct SetupFile {
    std::string path;  ///< as the component named it
    int error = 0;     ///< errno of the failure; 0: it was opened
    std::string bytes = {};
};

}  // namespace hal
