// SPDX-License-Identifier: MIT
#include <cmath>
#include <gtest/gtest.h>
#include <numbers>
#include <optional>
#include <random>

#include "tools/scope/measure.hpp"

namespace hal::tools {
namespace {

constexpr double pi = std::numbers::pi;

template <class F>
Samples sampled(int from_ms, int to_ms, F f) {
    Samples samples;
    for (int i = from_ms; i <= to_ms; ++i) {
        samples.push_back({i * 1'000'000LL, f(i * 1e-3)});
    }
    return samples;
}

Measurements measure_all(const Samples& samples, std::optional<std::int64_t> step_ns = 0) {
    return measure(samples, samples.front().time_ns, samples.back().time_ns, step_ns);
}

TEST(Measure, a_noisy_sine_has_the_frequency_of_its_periods_not_of_its_crossings) {
    std::mt19937 random(1);
    std::normal_distribution<double> noise(0, 0.1);
    const auto found = measure_all(
        sampled(0, 2000, [&](double t) { return std::sin(2 * pi * 5 * t) + noise(random); }));
    ASSERT_TRUE(found.frequency_hz);
    EXPECT_NEAR(*found.frequency_hz, 5, 0.05);
    EXPECT_NEAR(*found.rms, std::sqrt(0.5 + 0.01), 0.02);
    EXPECT_NEAR(*found.mean, 0, 0.02);
    EXPECT_NEAR(*found.duty, 0.5, 0.02);
    EXPECT_FALSE(found.overshoot_percent) << "a sine never settles";
}

TEST(Measure, mean_and_rms_are_taken_over_whole_periods) {
    // two periods and a half
    const auto found =
        measure_all(sampled(0, 1250, [](double t) { return 3 + std::sin(2 * pi * 2 * t - 1); }));
    EXPECT_NEAR(*found.mean, 3, 1e-3);
    EXPECT_NEAR(*found.ac_rms, std::sqrt(0.5), 1e-3);
    EXPECT_NEAR(*found.rms, std::sqrt(9.5), 1e-3);
}

// A second-order system: overshoot exp(-zeta pi / sqrt(1 - zeta^2)).
double step_response(double t, double zeta, double w) {
    if (t < 0) return 0;
    const double damped = w * std::sqrt(1 - zeta * zeta);
    return 1 - std::exp(-zeta * w * t) * (std::cos(damped * t) +
                                          zeta / std::sqrt(1 - zeta * zeta) * std::sin(damped * t));
}

TEST(Measure, a_step_response_has_the_overshoot_and_settling_time_of_theory) {
    const double zeta = 0.3;
    const double w = 10 * pi;
    for (const double height : {2.0, -0.5}) {
        const auto found = measure_all(
            sampled(-100, 1400, [&](double t) { return 7 + height * step_response(t, zeta, w); }));
        ASSERT_TRUE(found.overshoot_percent) << height;
        EXPECT_NEAR(*found.overshoot_percent,
                    100 * std::exp(-zeta * pi / std::sqrt(1 - zeta * zeta)), 0.05);
        EXPECT_NEAR(*found.initial, 7, 1e-9);
        EXPECT_NEAR(*found.final, 7 + height, 1e-3);
        double outside = 0;  // the same by its definition on a fine grid
        for (double t = 0; t < 1.4; t += 1e-5) {
            if (std::abs(step_response(t, zeta, w) - 1) > 0.02) {
                outside = t;
            }
        }
        EXPECT_NEAR(*found.settling_s, outside, 1.1e-3);
        ASSERT_TRUE(found.rise_s);
        EXPECT_NEAR(*found.rise_s, 0.0421, 0.001);
    }
}

TEST(Measure, what_has_not_settled_within_the_window_is_unknown) {
    const auto found =
        measure_all(sampled(-100, 100, [](double t) { return step_response(t, 0.05, 10 * pi); }));
    EXPECT_FALSE(found.overshoot_percent);
    EXPECT_FALSE(found.settling_s);
}

TEST(Measure, nothing_that_is_no_step_has_the_figures_of_one) {
    const auto step = sampled(-100, 100, [](double t) { return t < 0 ? 0.0 : 1.0; });
    EXPECT_TRUE(measure_all(step).overshoot_percent);
    EXPECT_FALSE(measure_all(step, std::nullopt).overshoot_percent) << "no trigger";
    EXPECT_FALSE(measure_all(step, std::nullopt).settling_s) << "no trigger";
    // noise that is still at the end of the window
    const auto noise = sampled(
        -100, 100, [](double t) { return t < 0.05 ? 0.5 * std::sin(1.0 + t * 7000.0) : 0.25; });
    EXPECT_FALSE(measure_all(noise).overshoot_percent);
    EXPECT_FALSE(measure_all(noise).settling_s);
}

TEST(Measure, too_few_samples_on_an_edge_give_no_rise_time) {
    const auto found =
        measure_all(sampled(-20, 100, [](double t) { return t < 0.001 ? 0.0 : 1.0; }));
    ASSERT_TRUE(found.settling_s);
    EXPECT_EQ(*found.overshoot_percent, 0);
    EXPECT_FALSE(found.rise_s);
}

TEST(Measure, a_constant_and_nothing_have_no_period_and_no_step) {
    const auto flat = measure_all(sampled(-10, 10, [](double) { return 2.5; }));
    EXPECT_EQ(*flat.mean, 2.5);
    EXPECT_EQ(*flat.ac_rms, 0);
    EXPECT_FALSE(flat.frequency_hz);
    EXPECT_FALSE(flat.final);
    EXPECT_EQ(measure({}, 0, 1, 0).count, 0u);
    EXPECT_FALSE(measure({}, 0, 1, 0).mean);
}

TEST(Measure, not_a_number_makes_everything_unknown) {
    const auto found = measure_all({{0, 1.0}, {1, std::nan("")}, {2, 1.0}});
    EXPECT_EQ(found.count, 3u);
    EXPECT_FALSE(found.min);
    EXPECT_FALSE(found.mean);
}

TEST(Measure, a_window_takes_its_own_samples_only) {
    const auto found = measure({{0, 1.0}, {10, 2.0}, {20, 3.0}, {30, 4.0}}, 10, 20, 0);
    EXPECT_EQ(found.count, 2u);
    EXPECT_EQ(*found.min, 2);
    EXPECT_EQ(*found.max, 3);
}

TEST(Measure, the_value_at_a_time_is_interpolated_or_held) {
    const Samples samples{{0, 1.0}, {10, 3.0}};
    EXPECT_EQ(*value_at(samples, 5, false), 2);
    EXPECT_EQ(*value_at(samples, 5, true), 1);
    EXPECT_EQ(*value_at(samples, 99, false), 3);
    EXPECT_FALSE(value_at(samples, -1, true));
}

TEST(Measure, values_are_formatted_with_prefix_and_unit) {
    EXPECT_EQ(format_measured(0.01234, "V"), "12.34 mV");
    EXPECT_EQ(format_measured(12345, "Hz"), "12.35 kHz");
    EXPECT_EQ(format_measured(-0.5), "-0.5");
    EXPECT_EQ(format_measured(0.012, "mm"), "0.012 mm");
    EXPECT_EQ(format_measured(0, "s"), "0 s");
    EXPECT_EQ(format_measured(37.23, "%"), "37.23 %");
    EXPECT_EQ(format_measured(std::nullopt, "V"), "?");
}

}  // namespace
}  // namespace hal::tools
