// SPDX-License-Identifier: MIT
// What an emulated slave, or its line, does wrong.
#pragma once

#include <cstddef>
#include <cstdint>
#include <iterator>
#include <string>
#include <string_view>

namespace hal::modbus {

enum class FaultKind : std::uint8_t {
    silence,     ///< does not answer
    late,        ///< answers after `late_ns`
    corrupt,     ///< a byte of the answer is changed
    wrong_unit,  ///< answers with another address
    exception,   ///< answers with exception 4
    half,        ///< sends the first half of the answer
    noise,       ///< bytes on the line are changed, of requests and of answers
};
inline constexpr const char* fault_names[] = {"silence",   "late", "corrupt", "wrong-unit",
                                              "exception", "half", "noise"};
inline constexpr std::size_t fault_kinds = std::size(fault_names);
static_assert(static_cast<std::size_t>(FaultKind::noise) + 1 == fault_kinds);

struct SlaveFault {
    FaultKind kind = FaultKind::silence;
    std::uint8_t unit = 0;    ///< 0: all
    std::uint32_t every = 1;  ///< each n-th answer
    std::int64_t from_ns = 0;
    std::int64_t until_ns = INT64_MAX;  ///< since the first work()
    std::int64_t late_ns = 200'000'000;
    double share = 0.1;         ///< of the bytes, of noise
    std::uint64_t matches = 0;  ///< answers so far
    bool is_active = true;
};

/// Parses `late:unit=2:every=50:late=120ms:from=1s:for=2s` or `noise:share=0.1`. Returns the
/// problem, or "". [setup]
std::string parse_fault(std::string_view text, SlaveFault& fault);

}  // namespace hal::modbus
