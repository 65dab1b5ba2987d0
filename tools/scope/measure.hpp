// SPDX-License-Identifier: MIT
// Measurements on the samples of one channel.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "scope/samples.hpp"

namespace hal::tools {

/// Results; a measurement whose precondition is not met has no value: no sample, fewer than two
/// edges, no step, not settled within the window.
struct Measurements {
    std::size_t count = 0;  ///< samples in the window
    std::optional<double> min, max;
    /// over whole periods, or over the window when it has less than one
    std::optional<double> mean, rms, ac_rms;
    /// from rising crossings of the mid level, with hysteresis
    std::optional<double> frequency_hz, duty;
    /// means before the step, and of the last 10 % of the window
    std::optional<double> initial, final;
    std::optional<double> rise_s;  ///< from 10 % to 90 % of the step, interpolated
    std::optional<double> overshoot_percent;  ///< 100 (extreme - final) / (final - initial)
    /// from the step until |x - final| stays within 2 % of the step
    std::optional<double> settling_s;
};

/// Measures between begin_ns and end_ns, both included. `step_ns`: the time of the step that a step
/// response is measured from, which is the trigger's; none: no step response.
Measurements measure(const Samples& samples, std::int64_t begin_ns, std::int64_t end_ns,
                     std::optional<std::int64_t> step_ns);

/// Returns the value that holds at `time_ns`: linear between samples, or of the sample before when
/// `stepped`; no value before the first sample.
std::optional<double> value_at(const Samples& samples, std::int64_t time_ns, bool stepped);

/// Formats a value with four digits and, for units that take one, an SI prefix: "12.34 mV", "0.5
/// deg", "-0.5"; "?" without a value.
std::string format_measured(const std::optional<double>& value, const std::string& unit = "");

}  // namespace hal::tools
