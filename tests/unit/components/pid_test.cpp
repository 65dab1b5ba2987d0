// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "unit/components/pid_loop.hpp"

namespace {

using hal::test::Instance;
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

using Loop = hal::test::PidLoop;

TEST(Pid, Proportional_term_and_bias_make_the_output) {
    Loop loop;
    loop.set("Pgain", 2.0);
    loop.set("bias", 0.5);
    EXPECT_EQ(loop.step(3.0, 1.0), 4.5);
    EXPECT_EQ(loop.real("error"), 2.0);
}

TEST(Pid, Disabled_its_output_is_zero_and_the_error_goes_on) {
    Loop loop;
    loop.set("Pgain", 2.0);
    loop.set("Igain", 1000.0);
    loop.set("bias", 0.5);
    loop.step(3.0, 1.0);
    loop.set("enable", false);
    EXPECT_EQ(loop.step(3.0, 2.0), 0.0);
    EXPECT_EQ(loop.real("error"), 1.0);
    EXPECT_EQ(loop.real("errorI"), 0.0);
    loop.set("enable", true);
    EXPECT_DOUBLE_EQ(loop.step(3.0, 2.0), 0.5 + 2.0 + 1000.0 * 1e-3);
}

// The manual's example: an error of 0.02 for 10 seconds is an errorI of 0.2; with Igain 20 it adds
// 4.
TEST(Pid, Integral_term_sums_the_error_over_time) {
    Loop loop;
    loop.set("Igain", 20.0);
    for (int i = 0; i < 10'000; ++i) {
        loop.step(0.02, 0.0);
    }
    EXPECT_NEAR(loop.real("errorI"), 0.2, 1e-12);
    EXPECT_NEAR(loop.output(), 4.0, 1e-10);
}

// An error that rises from 0.02 to 0.03 in 0.2 seconds is an errorD of 0.05; with Dgain 5 it adds
// 0.25.
TEST(Pid, Derivative_term_is_the_slope_of_the_error) {
    Loop loop;
    loop.set("Dgain", 5.0);
    EXPECT_EQ(loop.step(0.0, -0.02, 200'000'000), 0.0) << "no slope in the first cycle";
    EXPECT_NEAR(loop.step(0.0, -0.03, 200'000'000), 0.25, 1e-12);
    EXPECT_NEAR(loop.real("errorD"), 0.05, 1e-12);
    EXPECT_NEAR(loop.real("feedbackD"), -0.05, 1e-12);
}

TEST(Pid, Feed_forward_uses_the_command_and_its_derivatives) {
    Loop loop;
    // per cycle of 1 s: third difference 6e-3
    const auto command = [](int k) { return 1e-3 * k * k * k; };
    const auto run = [&] {
        for (int k = 0; k < 6; ++k) {
            loop.step(command(k), command(k), 1'000'000'000);
        }
        return loop.output();
    };
    loop.set("FF0", 2.0);
    EXPECT_NEAR(run(), 2.0 * 0.125, 1e-12);
    loop.set("FF0", 0.0);
    const char* const pins[] = {"FF1", "FF2", "FF3"};
    const double differences[] = {0.125 - 0.064, 0.125 - 2 * 0.064 + 0.027, 6e-3};
    for (int i = 0; i < 3; ++i) {
        loop.set(pins[i], 10.0);
        EXPECT_NEAR(run(), 10.0 * differences[i], 1e-12) << pins[i];
        loop.set(pins[i], 0.0);
    }
    EXPECT_NEAR(loop.real("commandD"), differences[0], 1e-12);
    EXPECT_NEAR(loop.real("commandDD"), differences[1], 1e-12);
    EXPECT_NEAR(loop.real("commandDDD"), differences[2], 1e-12);
}

TEST(Pid, Deadband_swallows_small_errors_and_is_taken_from_large_ones) {
    Loop loop;
    loop.set("Pgain", 1.0);
    loop.set("deadband", 0.5);
    EXPECT_EQ(loop.step(0.4, 0.0), 0.0);
    EXPECT_EQ(loop.step(-0.5, 0.0), 0.0);
    EXPECT_EQ(loop.step(2.0, 0.0), 1.5);
    EXPECT_EQ(loop.step(-2.0, 0.0), -1.5);
    EXPECT_EQ(loop.real("error"), -2.0) << "the pin shows the error as it is";
}

TEST(Pid, Every_limit_limits_and_zero_is_none) {
    Loop loop;
    loop.set("Pgain", 1.0);
    EXPECT_EQ(loop.step(100.0, 0.0), 100.0);
    loop.set("maxerror", 3.0);
    EXPECT_EQ(loop.step(100.0, 0.0), 3.0);
    EXPECT_EQ(loop.step(-100.0, 0.0), -3.0);
    loop.set("Pgain", 0.0);
    loop.set("maxerror", 0.0);

    loop.set("Igain", 1.0);
    loop.set("maxerrorI", 0.25);
    for (int i = 0; i < 10; ++i) {
        loop.step(100.0, 0.0);
    }
    EXPECT_EQ(loop.output(), 0.25);
    loop.set("Igain", 0.0);

    loop.set("Dgain", 1.0);
    loop.set("maxerrorD", 7.0);
    loop.step(0.0, 0.0);
    EXPECT_EQ(loop.step(0.0, -1.0), 7.0);
    loop.set("Dgain", 0.0);

    const char* const gains[] = {"FF1", "FF2", "FF3"};
    const char* const limits[] = {"maxcmdD", "maxcmdDD", "maxcmdDDD"};
    for (int i = 0; i < 3; ++i) {
        loop.set(gains[i], 1.0);
        loop.set(limits[i], 0.5);
        for (int settle = 0; settle < 5; ++settle) {
            loop.step(0.0, 0.0);
        }
        EXPECT_EQ(loop.step(1.0, 1.0), 0.5) << limits[i];
        loop.set(gains[i], 0.0);
        loop.set(limits[i], 0.0);
    }
}

TEST(Pid, Saturation_is_shown_with_its_duration) {
    Loop loop;
    loop.set("Pgain", 1.0);
    loop.set("maxoutput", 2.0);
    EXPECT_EQ(loop.step(1.0, 0.0), 1.0);
    EXPECT_FALSE(loop.get<bool>("saturated"));
    for (int i = 0; i < 3; ++i) {
        EXPECT_EQ(loop.step(-5.0, 0.0), -2.0);
    }
    EXPECT_TRUE(loop.get<bool>("saturated"));
    EXPECT_NEAR(loop.real("saturated-s"), 0.003, 1e-15);
    EXPECT_EQ(loop.get<std::int32_t>("saturated-count"), 3);
    loop.step(1.0, 0.0);
    EXPECT_FALSE(loop.get<bool>("saturated"));
    EXPECT_EQ(loop.real("saturated-s"), 0.0);
    EXPECT_EQ(loop.get<std::int32_t>("saturated-count"), 0);
}

TEST(Pid, Taking_the_output_limit_away_ends_saturation) {
    Loop loop;
    loop.set("Pgain", 1.0);
    loop.set("Igain", 1.0);
    loop.set("maxoutput", 2.0);
    loop.step(5.0, 0.0);
    ASSERT_TRUE(loop.get<bool>("saturated"));
    loop.set("maxoutput", 0.0);
    loop.step(5.0, 0.0);
    EXPECT_FALSE(loop.get<bool>("saturated"));
    EXPECT_EQ(loop.get<std::int32_t>("saturated-count"), 0);
    const double integral = loop.real("errorI");
    loop.step(5.0, 0.0);
    EXPECT_GT(loop.real("errorI"), integral) << "integrates again";
}

TEST(Pid, The_integral_does_not_wind_up_while_saturated) {
    Loop loop;
    loop.set("Pgain", 1.0);
    loop.set("Igain", 1.0);
    loop.set("maxoutput", 2.0);
    for (int i = 0; i < 1000; ++i) {
        loop.step(5.0, 0.0);
    }
    EXPECT_NEAR(loop.real("errorI"), 0.005, 1e-12) << "one cycle, before it was saturated";
    loop.step(-1.0, 0.0);
    EXPECT_NEAR(loop.real("errorI"), 0.004, 1e-12) << "what leads out counts";
}

TEST(Pid, Error_previous_target_compares_with_the_target_of_the_cycle_before) {
    Loop loop;
    loop.set("error-previous-target", true);
    loop.step(1.0, 0.25);
    EXPECT_EQ(loop.real("error"), 0.75) << "the first cycle has no cycle before";
    loop.step(5.0, 0.25);
    EXPECT_EQ(loop.real("error"), 0.75);
    loop.step(5.0, 0.25);
    EXPECT_EQ(loop.real("error"), 4.75);
    EXPECT_TRUE(Instance("pid").get<bool>("error-previous-target")) << "is the default";
}

TEST(Pid, A_jump_of_the_coordinates_at_the_index_makes_no_spike) {
    for (const bool previous_target : {false, true}) {
        Loop loop;
        loop.set("error-previous-target", previous_target);
        loop.set("Pgain", 1.0);
        loop.set("Dgain", 1.0);
        loop.set("FF1", 1.0);
        loop.set("FF2", 1.0);
        loop.set("index-enable", true);
        double position = 0.0;
        for (int i = 0; i < 10; ++i, position += 2e-3) {
            loop.step(position, position);
        }
        const double steady = loop.output();
        EXPECT_NEAR(loop.real("commandD"), 2.0, 1e-9);
        loop.set("index-enable", false);
        position -= 100.0;
        loop.step(position, position);
        EXPECT_NEAR(loop.output(), steady, 3e-3) << "in the cycle of the index";
        EXPECT_NEAR(loop.real("commandD"), 2.0, 1e-9);
        for (int i = 0; i < 3; ++i) {
            position += 2e-3;
            EXPECT_NEAR(loop.step(position, position), steady, 3.0 + 1e-9);
            EXPECT_NEAR(loop.real("commandD"), 2.0, 1e-9);
        }
    }
}

TEST(Pid, The_derivative_damps_where_deadband_and_maxerror_take_the_error_away) {
    Loop loop;
    loop.set("Dgain", 1.0);
    loop.set("deadband", 0.5);
    loop.set("maxerror", 1.0);
    for (const double offset : {0.0, 50.0}) {
        loop.step(0.0, offset);
        loop.step(0.0, offset);
        EXPECT_NEAR(loop.step(0.0, offset + 1e-3), -1.0, 1e-9) << offset;
    }
    loop.set("error-previous-target", true);
    loop.step(0.0, 0.0);
    EXPECT_NEAR(loop.step(1e-3, 0.0), 1.0, 1e-9) << "the slope of this cycle";
}

// The slope is held; what is derived from it goes on from there, so over both cycles the second
// derivative adds up.
TEST(Pid, At_the_index_only_the_slope_is_held) {
    Loop loop;
    loop.set("index-enable", true);
    for (const double command : {0.0, 1e-3, 3e-3}) {
        loop.step(command, 0.0);
    }
    EXPECT_NEAR(loop.real("commandDD"), 1000.0, 1e-6);
    loop.set("index-enable", false);
    loop.step(-7.0, 0.0);
    EXPECT_NEAR(loop.real("commandD"), 2.0, 1e-9);
    EXPECT_NEAR(loop.real("commandDD"), 0.0, 1e-6);
    EXPECT_NEAR(loop.real("errorD"), 2.0, 1e-9);
    loop.step(-7.0 + 4e-3, 0.0);
    EXPECT_NEAR(loop.real("commandDD"), 2000.0, 1e-6);
}

TEST(Pid, Linked_derivatives_are_used_instead_of_estimates) {
    Loop loop;
    loop.set("FF1", 1.0);
    loop.set("command-deriv", 12.0);
    loop.step(0.0, 0.0);
    EXPECT_EQ(loop.step(0.0, 0.0), 0.0) << "not linked: estimated";
    loop.link("command-deriv");
    EXPECT_EQ(loop.step(0.0, 0.0), 12.0);
    loop.set("FF1", 0.0);
    loop.set("Dgain", 2.0);
    EXPECT_EQ(loop.step(0.0, 0.0), 24.0) << "errorD = command-deriv - estimated feedbackD";
    loop.link("feedback-deriv");
    loop.set("feedback-deriv", 5.0);
    EXPECT_EQ(loop.step(0.0, 77.0), 14.0);
    EXPECT_EQ(loop.real("feedbackD"), 5.0);
}

TEST(Pid, Enabling_in_motion_makes_no_spike) {
    Loop loop;
    loop.set("Dgain", 1.0);
    loop.set("FF1", 1.0);
    loop.set("enable", false);
    double position = 50.0;
    for (int i = 0; i < 5; ++i, position += 3e-3) {
        loop.step(position, 0.0);
    }
    loop.set("enable", true);
    EXPECT_NEAR(loop.step(position, 0.0), 6.0, 1e-9) << "errorD 3, commandD 3";
}

TEST(Pid, An_input_that_is_not_a_number_stops_the_output_for_that_cycle_only) {
    Loop loop;
    loop.set("Pgain", 1.0);
    loop.set("Igain", 1.0);
    loop.set("Dgain", 0.1);
    loop.set("FF1", 0.1);
    loop.set("FF2", 0.1);
    loop.set("FF3", 0.1);
    for (const char* pin : {"feedback", "command"}) {
        for (int i = 0; i < 100; ++i) {
            loop.step(1.0, 0.0);
        }
        const double before = loop.output();
        loop.set(pin, nan);
        loop.run("do-pid-calcs");
        EXPECT_EQ(loop.output(), 0.0) << pin;
        EXPECT_TRUE(std::isnan(loop.real("error"))) << pin;
        for (int i = 0; i < 4; ++i) {
            loop.step(1.0, 0.0);
        }
        EXPECT_NEAR(loop.output(), before + 0.004, 1e-9) << pin;
    }
    EXPECT_TRUE(loop.pin("error").flags & HAL_PIN_FINITE);
}

TEST(Pid, An_infinite_gain_stops_the_output_until_it_is_taken_back) {
    Loop loop;
    loop.set("Pgain", std::numeric_limits<double>::infinity());
    EXPECT_EQ(loop.step(1.0, 0.0), 0.0);
    loop.set("Pgain", 1.0);
    EXPECT_EQ(loop.step(1.0, 0.0), 1.0);
}

TEST(Pid, Debug_pins_are_there_on_request_only) {
    const Instance plain("pid"), debug("pid", {{"debug", "1"}});
    for (const char* pin : {"errorI", "errorD", "commandD", "commandDD", "commandDDD", "feedbackD",
                            "ultimate-gain", "ultimate-period"}) {
        EXPECT_FALSE(plain.has_pin(pin)) << pin;
        EXPECT_TRUE(debug.has_pin(pin)) << pin;
    }
    EXPECT_THROW(Instance("pid", {{"debug", "2"}}), std::runtime_error);
    EXPECT_EQ(plain.component().default_count, 3u);
}

}  // namespace
