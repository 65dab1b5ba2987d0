// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <vector>

#include "unit/components/component_host.hpp"

namespace {

using hal::test::Instance;
constexpr std::int64_t eighth = 125'000'000;  // an eighth of the default period of one second
const double root = std::sqrt(0.5);

const std::map<std::string, std::vector<double>> one_period = {
    {"sine", {0, root, 1, root, 0, -root, -1, -root}},
    {"cosine", {1, root, 0, -root, -1, -root, 0, root}},
    {"triangle", {1, 0.5, 0, -0.5, -1, -0.5, 0, 0.5}},
    {"sawtooth", {-1, -0.75, -0.5, -0.25, 0, 0.25, 0.5, 0.75}},
    {"square", {-1, -1, -1, -1, -1, 1, 1, 1}},
};

TEST(Siggen, Waves_have_their_shape_and_phase) {
    Instance siggen("siggen");
    for (std::size_t sample = 0; sample < 24; ++sample) {
        siggen.run("update", eighth);
        for (const auto& [wave, values] : one_period) {
            EXPECT_NEAR(siggen.get<double>(wave), values[(sample + 1) % 8], 1e-12)
                << wave << " " << sample;
        }
        EXPECT_EQ(siggen.get<bool>("clock"), one_period.at("square")[(sample + 1) % 8] > 0.0);
    }
}

TEST(Siggen, Amplitude_offset_and_frequency_apply) {
    Instance siggen("siggen");
    siggen.set("amplitude", 3.0);
    siggen.set("offset", 10.0);
    siggen.set("frequency", 2.0);
    for (std::size_t sample = 0; sample < 8; ++sample) {
        siggen.run("update", eighth);
        for (const auto& [wave, values] : one_period) {
            EXPECT_NEAR(siggen.get<double>(wave), 10.0 + 3.0 * values[2 * (sample + 1) % 8], 1e-12)
                << wave << " " << sample;
        }
    }
}

TEST(Siggen, Reset_holds_the_middle_of_the_period) {
    Instance siggen("siggen");
    siggen.set("amplitude", 2.0);
    for (int i = 0; i < 3; ++i) {
        siggen.run("update", eighth);
    }
    siggen.set("reset", true);
    for (int i = 0; i < 2; ++i) {
        siggen.run("update", eighth);
        EXPECT_EQ(siggen.get<double>("sine"), 0.0);
        EXPECT_EQ(siggen.get<double>("sawtooth"), 0.0);
        for (const char* wave : {"square", "cosine", "triangle"}) {
            EXPECT_EQ(siggen.get<double>(wave), -2.0) << wave;
        }
        EXPECT_FALSE(siggen.get<bool>("clock"));
    }
    siggen.set("reset", false);
    siggen.run("update", eighth);
    EXPECT_EQ(siggen.get<double>("sawtooth"), 0.5);
    EXPECT_TRUE(siggen.get<bool>("clock"));
}

TEST(Siggen, Runs_backwards_and_survives_any_frequency) {
    Instance siggen("siggen");
    siggen.set("frequency", -1.0);
    siggen.run("update", eighth);
    EXPECT_NEAR(siggen.get<double>("sine"), -root, 1e-12);
    for (const double bad : {std::numeric_limits<double>::quiet_NaN(),
                             std::numeric_limits<double>::infinity(), -1e-20, 1e300}) {
        siggen.set("frequency", bad);
        siggen.run("update", eighth);
        EXPECT_LE(std::fabs(siggen.get<double>("triangle")), 1.0) << bad;
        EXPECT_LE(std::fabs(siggen.get<double>("sawtooth")), 1.0) << bad;
    }
    siggen.set("frequency", 1.0);
    siggen.run("update", eighth);
    EXPECT_TRUE(std::isfinite(siggen.get<double>("cosine")));
}

TEST(Siggen, Limits_the_frequency_to_half_the_rate_and_shows_it) {
    Instance siggen("siggen");
    siggen.set("frequency", 5.0);
    siggen.run("update", eighth);
    EXPECT_EQ(siggen.get<double>("frequency"), 4.0);
    EXPECT_EQ(siggen.get<double>("sawtooth"), 0.0);
}

TEST(Siggen, A_phase_just_below_zero_does_not_round_up_to_a_whole_period) {
    Instance siggen("siggen");
    siggen.set("frequency", -1e-20);
    for (int i = 0; i < 2; ++i) {
        siggen.run("update", eighth);
        EXPECT_EQ(siggen.get<double>("sawtooth"), -1.0);
        EXPECT_FALSE(siggen.get<bool>("clock"));
    }
}

}  // namespace
