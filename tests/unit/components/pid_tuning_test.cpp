// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <deque>
#include <limits>
#include <numbers>
#include <random>

#include "unit/components/pid_loop.hpp"

namespace {

using Loop = hal::test::PidLoop;
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// x' = output, seen by the loop after a dead time.
struct DelayedIntegrator {
    double x = 0.0;
    std::deque<double> line;
    explicit DelayedIntegrator(std::size_t dead_cycles) : line(dead_cycles, 0.0) {}
    double step(double output) {
        x += output * 1e-3;
        line.push_back(x);
        const double seen = line.front();
        line.pop_front();
        return seen;
    }
};

void start_tuning(Loop& loop, int type) {
    loop.set("tune-type", type);
    loop.set("tune-effort", 2.0);
    loop.set("tune-cycles", 40);
    loop.set("tune-mode", true);
    loop.set("tune-start", true);
}

// A relay of height h around an integrator with dead time L swings with amplitude h L and period 4
// L.
TEST(Pid_auto_tuning, Finds_the_ultimate_gain_of_an_integrator_with_dead_time) {
    for (const int type : {0, 1}) {
        Loop loop;
        loop.set("Dgain", 0.7);
        DelayedIntegrator plant(100);
        start_tuning(loop, type);
        int cycles = 0;
        for (double seen = 0.0; loop.get<bool>("tune-start"); ++cycles) {
            ASSERT_LT(cycles, 100'000);
            seen = plant.step(loop.step(0.0, seen));
            EXPECT_EQ(std::fabs(loop.output()), loop.get<bool>("tune-start") ? 2.0 : 0.0);
        }
        EXPECT_NEAR(loop.real("ultimate-gain"), 4.0 / (std::numbers::pi * 0.1), 0.02 * 12.7);
        EXPECT_NEAR(loop.real("ultimate-period"), 0.4, 0.02 * 0.4);
        EXPECT_NEAR(cycles, 42 * 200, 200);

        const double gain = loop.real("ultimate-gain");
        const double period = loop.real("ultimate-period");

        const double p = loop.real("Pgain");
        EXPECT_DOUBLE_EQ(p, (type ? 0.45 : 0.6) * gain);
        EXPECT_DOUBLE_EQ(loop.real("Igain"), type ? p / (period / 1.2) : p / (period / 2.0));
        EXPECT_NEAR(loop.real("Dgain"), type ? 0.0 : p * period / 8.0, 1e-12);
        EXPECT_EQ(loop.real("FF1"), type ? 1.0 : 0.0);
    }
}

TEST(Pid_auto_tuning, Tuned_gains_make_a_stable_loop) {
    Loop loop;
    DelayedIntegrator plant(50);
    start_tuning(loop, 0);
    double seen = 0.0;
    while (loop.get<bool>("tune-start")) {
        seen = plant.step(loop.step(0.0, seen));
    }
    loop.set("tune-mode", false);
    for (int i = 0; i < 20'000; ++i) {
        seen = plant.step(loop.step(1.0, seen));
    }
    EXPECT_NEAR(seen, 1.0, 1e-3);
}

TEST(Pid_auto_tuning, Swings_about_the_bias_within_maxoutput_and_rests_there) {
    Loop loop;
    loop.set("Pgain", 9.0);
    loop.set("bias", 1.0);
    loop.set("maxoutput", 2.5);
    loop.set("tune-mode", true);
    EXPECT_EQ(loop.step(0.0, 5.0), 1.0) << "the loop is open before tune-start";
    start_tuning(loop, 0);
    EXPECT_EQ(loop.step(0.0, 5.0), -1.0);
    EXPECT_EQ(loop.step(0.0, -5.0), 2.5);
    EXPECT_FALSE(loop.get<bool>("saturated"));
}

TEST(Pid_auto_tuning, Is_aborted_by_enable_tune_mode_and_tune_start_without_touching_the_gains) {
    for (const char* pin : {"enable", "tune-mode", "tune-start"}) {
        Loop loop;
        loop.set("Pgain", 3.0);
        start_tuning(loop, 0);
        for (int i = 0; i < 50; ++i) {
            loop.step(0.0, i % 10 < 5 ? 1.0 : -1.0);
        }
        ASSERT_TRUE(loop.get<bool>("tune-start"));
        loop.set(pin, false);
        loop.step(0.0, 0.0);
        EXPECT_FALSE(loop.get<bool>("tune-start")) << pin;
        EXPECT_EQ(loop.real("Pgain"), 3.0);
        loop.set(pin, pin != std::string("tune-start"));
        loop.step(0.0, 1.0);
        EXPECT_EQ(loop.output(), 0.0) << pin << " does not start it again";
    }
}

TEST(Pid_auto_tuning, Is_rejected_when_noise_has_switched_the_output_however_few_the_half_cycles) {
    for (const int half_cycles : {0, 1, 3, 4, 6, 10, 50}) {
        for (unsigned seed = 1; seed <= 50; ++seed) {
            Loop loop;
            loop.set("Pgain", 3.0);
            start_tuning(loop, 0);
            loop.set("tune-cycles", half_cycles);
            std::mt19937 noise(seed);
            int cycles = 0;
            for (; loop.get<bool>("tune-start") && cycles < 10'000; ++cycles) {
                loop.step(0.0, static_cast<double>(noise()) / 4294967296.0 - 0.5);
            }
            EXPECT_GE(cycles, 30) << half_cycles;
            EXPECT_FALSE(loop.get<bool>("tune-start"));
            EXPECT_EQ(loop.real("Pgain"), 3.0) << half_cycles << " half cycles, seed " << seed;
        }
    }
}

TEST(Pid_auto_tuning, Leaves_linked_gains_to_their_signal) {
    Loop loop;
    loop.link("Pgain");
    loop.set("Pgain", 3.0);
    start_tuning(loop, 0);
    for (int i = 0; loop.get<bool>("tune-start") && i < 10'000; ++i) {
        loop.step(0.0, i % 10 < 5 ? 1.0 : -1.0);
    }
    EXPECT_EQ(loop.real("Pgain"), 3.0);
    EXPECT_GT(loop.real("Igain"), 0.0);
}

TEST(Pid_auto_tuning, Ends_when_the_feedback_is_lost_or_nothing_swings) {
    Loop lost;
    start_tuning(lost, 0);
    lost.step(0.0, 1.0);
    EXPECT_EQ(lost.step(0.0, nan), 0.0);
    EXPECT_FALSE(lost.get<bool>("tune-start"));

    Loop still;  // an error of exactly 0 never crosses 0
    still.set("Pgain", 3.0);
    start_tuning(still, 0);
    for (int i = 0; i < 1000; ++i) {
        still.step(0.0, 0.0);
    }
    EXPECT_TRUE(still.get<bool>("tune-start"));
    still.set("tune-mode", false);
    still.step(0.0, 0.0);
    EXPECT_EQ(still.real("Pgain"), 3.0);
}

}  // namespace
