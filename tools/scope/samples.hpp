// SPDX-License-Identifier: MIT
// Sampled values as the scope keeps them.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace hal::tools {

struct Sample {
    std::int64_t time_ns = 0;  ///< of the cycle, on the machine's clock
    double value = 0;
};

using Samples = std::vector<Sample>;  ///< in order of time

struct Channel {
    std::string name, unit;  ///< unit empty: none declared
    bool stepped = false;    ///< a bit or an integer: the value holds until the next sample
    bool bit = false;
};

/// A finished acquisition. The samples of all channels lie in begin_ns..end_ns, and one before, whose value holds at the beginning.
struct Record {
    std::vector<Samples> samples;  ///< per channel
    std::int64_t begin_ns = 0, end_ns = 0;
    std::int64_t trigger_ns = 0;   ///< interpolated between two samples; time 0 of a picture
    bool triggered = false;        ///< false: automatic, rolling or forced
};

}  // namespace hal::tools
