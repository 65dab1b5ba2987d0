// SPDX-License-Identifier: MIT
// Sampled values as the scope keeps them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace hal::tools {

struct Sample {
    std::int64_t time_ns = 0;  ///< of the cycle, on the machine's clock
    double value = 0;
    /// of an s64 or u64: the value itself, which a double rounds from 2^53 on
    std::uint64_t word = 0;
};

using Samples = std::vector<Sample>;  ///< in order of time

struct Channel {
    std::string name, unit;  ///< unit empty: none declared
    bool stepped = false;    ///< a bit or an integer: the value holds until the next sample
    bool bit = false;
    enum class Wide : std::uint8_t { no, s64, u64 } wide = Wide::no;
};

/// Returns whether one value is below another.
inline bool below(const Channel& channel, const Sample& a, const Sample& b) {
    if (channel.wide == Channel::Wide::s64) {
        return static_cast<std::int64_t>(a.word) < static_cast<std::int64_t>(b.word);
    }
    return channel.wide == Channel::Wide::u64 ? a.word < b.word : a.value < b.value;
}

/// Returns all digits of an s64 or u64; of another channel "".
inline std::string digits(const Channel& channel, const Sample& sample) {
    if (channel.wide == Channel::Wide::s64) {
        return std::to_string(static_cast<std::int64_t>(sample.word));
    }
    return channel.wide == Channel::Wide::u64 ? std::to_string(sample.word) : "";
}

/// A finished acquisition. The samples of all channels lie in begin_ns..end_ns, and one before,
/// whose value holds at the beginning.
struct Record {
    std::vector<Samples> samples;  ///< per channel
    std::int64_t begin_ns = 0;
    std::int64_t end_ns = 0;
    std::int64_t trigger_ns = 0;   ///< interpolated between two samples; time 0 of a picture
    bool triggered = false;        ///< false: automatic, rolling or forced

    /// Returns when the step began that a response is measured from; none without a trigger.
    std::optional<std::int64_t> step_ns() const {
        return triggered ? std::optional(trigger_ns) : std::nullopt;
    }
};

}  // namespace hal::tools
