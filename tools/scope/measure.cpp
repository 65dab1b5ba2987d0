// SPDX-License-Identifier: MIT
// A step response is measured from the mean before the step (initial) to the mean of the last 10 %
// of the window (final). It has settled when the last sample outside final +- 2 % of the step lies
// before these 10 %; otherwise overshoot and settling time are unknown.
#include "scope/measure.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/core.h>
#include <span>
#include <string_view>
#include <vector>

namespace hal::tools {

namespace {

using View = std::span<const Sample>;

constexpr double band = 0.02;  // of the step: settled
constexpr double min_over_noise = 3;  // height of a step over the deviation before it
constexpr std::size_t min_before = 3;  // samples before a step
constexpr std::size_t min_on_edge = 5;  // samples on a rising edge
constexpr double crossing_hysteresis = 0.2;  // of the range

double mean_of(View samples) {
    double sum = 0;
    for (const Sample& sample : samples) {
        sum += sample.value;
    }
    return sum / static_cast<double>(samples.size());
}

/// Returns the standard deviation.
double noise_of(View samples) {
    const double mean = mean_of(samples);
    double squares = 0;
    for (const Sample& sample : samples) {
        squares += (sample.value - mean) * (sample.value - mean);
    }
    return std::sqrt(squares / static_cast<double>(samples.size()));
}

double crossing_ns(const Sample& before, const Sample& after, double level) {
    const double step = after.value - before.value;
    const double part = step != 0 ? (level - before.value) / step : 1;
    return static_cast<double>(before.time_ns) +
           part * static_cast<double>(after.time_ns - before.time_ns);
}

/// Rising crossings of the mid level: times, and the samples from which on they are.
struct Periods {
    std::vector<double> times_ns;
    std::vector<std::size_t> at;
};

Periods periods_of(View samples, double min, double max) {
    Periods periods;
    const double mid = (min + max) / 2;
    const double margin = crossing_hysteresis * (max - min);
    if (!(max > min)) return periods;
    bool low = false;
    // the newest crossing of the mid level upwards, which counts once the hysteresis is passed
    std::size_t up = 0;
    for (std::size_t i = 0; i < samples.size(); ++i) {
        const double x = samples[i].value;
        if (i > 0 && samples[i - 1].value < mid && x >= mid) {
            up = i;
        }
        if (x < mid - margin) {
            low = true;
        } else if (low && x > mid + margin && up > 0) {
            periods.times_ns.push_back(crossing_ns(samples[up - 1], samples[up], mid));
            periods.at.push_back(up);
            low = false;
        }
    }
    return periods;
}

/// Measures the response to a step at `step_ns`: settling time, overshoot, and rise time from 10 to
/// 90 % between the means before the step and of the last tenth of the samples. Sets nothing for a
/// step below 5 % of `range` or within the noise before it, or a response that does not settle.
void measure_step(View samples, std::int64_t step_ns, double range, Measurements& to) {
    const auto before =
        static_cast<std::size_t>(std::lower_bound(samples.begin(), samples.end(), step_ns,
                                                  [](const Sample& sample, std::int64_t t) {
        return sample.time_ns < t;
    }) - samples.begin());
    const std::size_t tail = std::max<std::size_t>(samples.size() / 10, 1);
    if (before < min_before || samples.size() < before + 2 * tail) return;
    const double first = mean_of(samples.first(before));
    const double last = mean_of(samples.last(tail));

    const double step = last - first;
    if (!(std::abs(step) > 0.05 * range)) return;
    if (std::abs(step) < min_over_noise * noise_of(samples.first(before))) return;
    to.initial = first;
    to.final = last;
    const View after = samples.subspan(before);
    std::size_t outside = 0;  // number of samples up to the last one outside of the band
    for (std::size_t i = 0; i < after.size(); ++i) {
        if (std::abs(after[i].value - last) > band * std::abs(step)) {
            outside = i + 1;
        }
    }
    if (outside + tail > after.size()) {
        return;  // not settled
    }
    to.settling_s =
        outside == 0 ? 0 : static_cast<double>(after[outside - 1].time_ns - step_ns) * 1e-9;
    double max = 0;
    for (const Sample& sample : after) {
        max = std::max(max, (sample.value - last) / step);
    }
    to.overshoot_percent = 100 * max;
    double low_ns = NAN;
    double high_ns = NAN;
    std::size_t low_at = 0;
    for (std::size_t i = before; i < samples.size() && std::isnan(high_ns); ++i) {
        if (i == 0) continue;
        const double from = (samples[i - 1].value - first) / step;

        const double now = (samples[i].value - first) / step;
        if (std::isnan(low_ns) && from < 0.1 && now >= 0.1) {
            low_ns = crossing_ns(samples[i - 1], samples[i], first + 0.1 * step);
            low_at = i;
        }
        if (!std::isnan(low_ns) && now >= 0.9) {
            high_ns = crossing_ns(samples[i - 1], samples[i], first + 0.9 * step);
            if (i - low_at + 1 >= min_on_edge) {
                to.rise_s = (high_ns - low_ns) * 1e-9;
            }
        }
    }
}

}  // namespace

Measurements measure(const Samples& samples, std::int64_t begin_ns, std::int64_t end_ns,
                     std::optional<std::int64_t> step_ns) {
    Measurements to;
    const auto earlier = [](const Sample& sample, std::int64_t t) { return sample.time_ns < t; };
    const auto from = std::lower_bound(samples.begin(), samples.end(), begin_ns, earlier);
    const auto until = std::lower_bound(from, samples.end(), end_ns + 1, earlier);
    const View view(from, until);
    to.count = view.size();
    if (view.empty() || std::any_of(view.begin(), view.end(), [](const Sample& sample) {
        return !std::isfinite(sample.value);
    })) {
        return to;
    }
    const auto [low, high] =
        std::minmax_element(view.begin(), view.end(),
                            [](const Sample& a, const Sample& b) { return a.value < b.value; });
    to.min = low->value;
    to.max = high->value;
    const Periods periods = periods_of(view, *to.min, *to.max);
    View whole = view;
    if (periods.at.size() >= 2) {
        whole = view.subspan(periods.at.front(), periods.at.back() - periods.at.front());
        to.frequency_hz = static_cast<double>(periods.at.size() - 1) * 1e9 /
                          (periods.times_ns.back() - periods.times_ns.front());
        const double mid = (*to.min + *to.max) / 2;
        const auto high_count = std::count_if(
            whole.begin(), whole.end(), [&](const Sample& sample) { return sample.value >= mid; });
        to.duty = static_cast<double>(high_count) / static_cast<double>(whole.size());
    }
    to.mean = mean_of(whole);
    double squares = 0;
    double deviations = 0;
    for (const Sample& sample : whole) {
        squares += sample.value * sample.value;
        deviations += (sample.value - *to.mean) * (sample.value - *to.mean);
    }
    to.rms = std::sqrt(squares / static_cast<double>(whole.size()));
    to.ac_rms = std::sqrt(deviations / static_cast<double>(whole.size()));
    if (step_ns) {
        measure_step(view, *step_ns, *to.max - *to.min, to);
    }
    return to;
}

std::optional<double> value_at(const Samples& samples, std::int64_t time_ns, bool stepped) {
    const auto after =
        std::upper_bound(samples.begin(), samples.end(), time_ns,
                         [](std::int64_t t, const Sample& sample) { return t < sample.time_ns; });
    if (after == samples.begin()) return std::nullopt;
    const Sample& before = *(after - 1);
    if (stepped || after == samples.end()) return before.value;
    const double part = static_cast<double>(time_ns - before.time_ns) /
                        static_cast<double>(after->time_ns - before.time_ns);
    return before.value + part * (after->value - before.value);
}

std::string format_measured(const std::optional<double>& value, const std::string& unit) {
    if (!value || !std::isfinite(*value)) return "?";
    static constexpr std::string_view scaled[] = {"s", "Hz", "V", "A", "W", "N", "Nm", "m"};
    const bool prefixed =
        *value != 0 && std::find(std::begin(scaled), std::end(scaled), unit) != std::end(scaled);
    if (!prefixed) {
        return fmt::format("{:.4g}{}{}", *value, unit.empty() ? "" : " ", unit);
    }
    static constexpr const char* prefixes[] = {"n", "u", "m", "", "k", "M", "G"};
    const int third =
        std::clamp(static_cast<int>(std::floor(std::log10(std::abs(*value)) / 3)), -3, 3);
    return fmt::format("{:.4g} {}{}", *value / std::pow(1000.0, third), prefixes[third + 3], unit);
}

}  // namespace hal::tools
