// SPDX-License-Identifier: MIT
// How long values are on a bus whose times are known beforehand. Who makes its schedule says so under the address of the link; who uses the
// link asks. Plain data, all of it [setup]; one registry in a process.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace hal::can {

#pragma GCC visibility push(default)

/// Between this station and another. Cycles are this station's, counted from the one in which a value is written or read here.
struct Way {
    std::string   station;          ///< the other one
    std::int64_t  there_ns = 0;     ///< from the beginning of the cycle that writes a value to the moment when the other one takes it
    std::int64_t  back_ns = 0;      ///< from the change of an input there, just after it was read, to the cycle that has it
    std::uint32_t there_cycles = 0, back_cycles = 0;
    std::uint32_t round_trip = 0;   ///< cycles from a value here to an input there that follows it, and back
};

/// `link` is the completed address of a link ("cane:enp3s0?slot=0"). What was said of it before is replaced.
void             offer_ways(std::string_view link, std::vector<Way> ways);
void             withdraw_ways(std::string_view link);
/// Empty: nobody knows.
std::vector<Way> ways_of(std::string_view link);

#pragma GCC visibility pop

}  // namespace hal::can
