// SPDX-License-Identifier: MIT
// When the scope's trigger fires.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "scope/samples.hpp"

namespace hal::tools {

/// above, below: the state, not the edge
enum class Edge { rising, falling, either, above, below };

struct Trigger {
    std::size_t source = 0;  ///< channel
    Edge edge = Edge::rising;
    double level = 0;
    bool magnitude = false;  ///< of the absolute value
};

/// A trigger as written: "x-error > 0.1", "|x-error| > 0.1", "level x-error > 0.1", "x-error <> 0"
/// (either edge), "estop" or "!estop" (a bit).
struct TriggerText {
    std::string name;
    Trigger trigger;  ///< without the source
    bool has_level = false;
    std::string problem;  ///< empty: none
};
TriggerText read_trigger(std::string_view text);

/// Formats a trigger as read_trigger() reads it.
std::string format_trigger(const Trigger& trigger, const std::vector<Channel>& channels);

/// Finds the trigger in the samples of one channel.
///   rising: armed below level - hysteresis, fires at the first sample at or above the level; falling mirrored.
/// The hysteresis is 1 % of the range seen so far, and 0 for bits. NaN neither arms nor fires.
class TriggerSearch {
public:
    TriggerSearch(const Trigger& trigger, bool bit) : trigger_(trigger), bit_(bit) {}

    /// Takes the next sample. Returns the time at which the trigger fired: for an edge between two
    /// samples interpolated, for a bit and a state the time of the sample.
    std::optional<std::int64_t> feed(Sample sample);
    /// Forgets edges in progress; the range seen so far stays.
    void rearm();
    double min() const { return min_; }  ///< of all samples; above most() before the first one
    double max() const { return max_; }

private:
    double margin_with(double value);
    bool crosses(double value, double margin);
    std::int64_t crossing_ns(const Sample& before, const Sample& after) const;

    Trigger trigger_;
    bool bit_;
    bool below_ = false;
    bool above_ = false;  ///< armed for a rising, a falling edge
    std::optional<Sample> last_;
    double min_ = 1;
    double max_ = -1;
};

}  // namespace hal::tools
