// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "unit/components/component_host.hpp"

namespace {

using hal::test::Instance;
constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double infinity = std::numeric_limits<double>::infinity();

/// `out` after one cycle with the given input.
double after(Instance& instance, double in, const char* pin = "in") {
    instance.set(pin, in);
    instance.run();
    return instance.get<double>("out");
}

TEST(Sum2, Weighs_both_inputs_and_adds_the_offset) {
    Instance sum("sum2");
    sum.set("in0", 3.0);
    EXPECT_EQ(after(sum, 4.0, "in1"), 7.0);
    sum.set("gain0", 2.0);
    sum.set("gain1", -0.5);
    sum.set("offset", 10.0);
    EXPECT_EQ(after(sum, 4.0, "in1"), 14.0);
}

TEST(Mult2, Multiplies) {
    Instance product("mult2");
    product.set("in0", -1.5);
    EXPECT_EQ(after(product, 4.0, "in1"), -6.0);
}

TEST(Scale, Applies_gain_then_offset) {
    Instance scale("scale");
    EXPECT_EQ(after(scale, 5.0), 0.0);
    scale.set("gain", 20.0);
    scale.set("offset", -40.0);
    EXPECT_EQ(after(scale, 5.0), 60.0);
}

TEST(Offset, Shifts_the_command_and_unshifts_the_feedback_in_two_functions) {
    Instance offset("offset");
    offset.set("offset", 2.5);
    offset.set("in", 10.0);
    offset.set("fb-in", 12.5);
    offset.run("update-output");
    EXPECT_EQ(offset.get<double>("out"), 12.5);
    EXPECT_EQ(offset.get<double>("fb-out"), 0.0);
    offset.run("update-feedback");
    EXPECT_EQ(offset.get<double>("fb-out"), 10.0);
}

TEST(Abs, Gives_the_magnitude_and_the_sign) {
    struct {
        double in, out;
        bool positive, negative;
    } const cases[] = {{-2.5, 2.5, false, true},
                       {0.0, 0.0, false, false},
                       {7.0, 7.0, true, false},
                       {-0.0, 0.0, false, false}};
    Instance abs("abs");
    for (const auto& c : cases) {
        EXPECT_EQ(after(abs, c.in), c.out);
        EXPECT_FALSE(std::signbit(abs.get<double>("out")));
        EXPECT_EQ(abs.get<bool>("is-positive"), c.positive);
        EXPECT_EQ(abs.get<bool>("is-negative"), c.negative);
        EXPECT_EQ(abs.get<bool>("sign"), c.negative);
    }
}

TEST(Comp, Without_hysteresis_compares) {
    Instance comp("comp");
    comp.set("in0", 5.0);
    for (const auto& [in1, out, equal] : {std::tuple{4.9, false, false},
                                          {5.0, false, true},
                                          {5.1, true, false},
                                          {5.0, true, true},
                                          {-5.0, false, false}}) {
        comp.set("in1", in1);
        comp.run();
        EXPECT_EQ(comp.get<bool>("out"), out) << in1;
        EXPECT_EQ(comp.get<bool>("equal"), equal) << in1;
    }
}

TEST(Comp, Hysteresis_separates_the_switching_points) {
    Instance comp("comp");
    comp.set("in0", 80.0);
    comp.set("hyst", 4.0);
    for (const auto& [in1, out, equal] : {std::tuple{81.9, false, true},
                                          {82.1, true, false},
                                          {78.1, true, true},
                                          {77.9, false, false},
                                          {nan, false, false}}) {
        comp.set("in1", in1);
        comp.run();
        EXPECT_EQ(comp.get<bool>("out"), out) << in1;
        EXPECT_EQ(comp.get<bool>("equal"), equal) << in1;
    }
}

TEST(Wcomp, Says_on_which_side_of_the_window_the_input_is) {
    Instance window("wcomp");
    window.set("min", -1.0);
    window.set("max", 2.0);
    for (const auto& [in, expected] : {std::pair{-2.0, "under"},
                                       {-1.0, "under"},
                                       {0.0, "out"},
                                       {2.0, "over"},
                                       {3.0, "over"},
                                       {nan, ""}}) {
        window.set("in", in);
        window.run();
        for (const char* pin : {"under", "out", "over"}) {
            EXPECT_EQ(window.get<bool>(pin), std::string(pin) == expected) << in << " " << pin;
        }
    }
}

TEST(Ddt, Differentiates_an_input_that_was_0_before_the_first_cycle) {
    Instance ddt("ddt");
    EXPECT_NEAR(after(ddt, 5.0), 5000.0, 1e-9);
    EXPECT_NEAR(after(ddt, 5.002), 2.0, 1e-9);
    EXPECT_EQ(after(ddt, 5.002), 0.0);
}

TEST(Ddt, Forgets_an_input_that_is_not_a_number) {
    Instance ddt("ddt");
    after(ddt, 1.0);
    EXPECT_TRUE(std::isnan(after(ddt, nan)));
    EXPECT_EQ(after(ddt, 7.0), 0.0);
    EXPECT_NEAR(after(ddt, 7.001), 1.0, 1e-9);
}

TEST(Integ, Integrates_gain_times_input_over_time) {
    Instance integ("integ");
    integ.set("in", 4.0);
    integ.set("gain", 0.5);
    integ.run(1000);
    EXPECT_NEAR(integ.get<double>("out"), 2.0, 1e-12);
    integ.set("reset", true);
    integ.run();
    EXPECT_EQ(integ.get<double>("out"), 0.0);
}

TEST(Integ, Stops_at_its_limits_without_winding_up) {
    Instance integ("integ");
    integ.set("in", 1000.0);
    integ.set("max", 3.0);
    integ.set("min", -1.0);
    integ.run(100);
    EXPECT_EQ(integ.get<double>("out"), 3.0);
    EXPECT_NEAR(after(integ, -1000.0), 2.0, 1e-12);
    integ.run(100);
    EXPECT_EQ(integ.get<double>("out"), -1.0);
}

TEST(Integ, Leaves_out_what_is_not_a_number) {
    Instance integ("integ");
    EXPECT_NEAR(after(integ, 1000.0), 1.0, 1e-12);
    EXPECT_NEAR(after(integ, nan), 1.0, 1e-12);
    EXPECT_NEAR(after(integ, 1000.0), 2.0, 1e-12);
}

TEST(Lowpass, Answers_a_step_exponentially) {
    Instance lowpass("lowpass");
    lowpass.set("gain", 0.25);
    for (int n = 1; n <= 20; ++n) {
        EXPECT_NEAR(after(lowpass, 8.0), 8.0 * (1.0 - std::pow(0.75, n)), 1e-12) << n;
    }
}

TEST(Lowpass, Load_copies_the_input_and_nothing_poisons_it) {
    Instance lowpass("lowpass");
    lowpass.set("gain", 0.5);
    lowpass.set("load", true);
    EXPECT_EQ(after(lowpass, 6.0), 6.0);
    EXPECT_EQ(after(lowpass, nan), 6.0);
    lowpass.set("load", false);
    EXPECT_EQ(after(lowpass, infinity), 6.0);
    EXPECT_EQ(after(lowpass, 10.0), 8.0);
}

TEST(Hypot, Is_the_length_of_the_vector) {
    Instance hypot("hypot");
    hypot.set("in0", 2.0);
    hypot.set("in1", -3.0);
    EXPECT_EQ(after(hypot, 6.0, "in2"), 7.0);
    hypot.set("in0", 3e200);
    hypot.set("in1", 4e200);
    EXPECT_NEAR(after(hypot, 0.0, "in2") / 5e200, 1.0, 1e-12);
}

TEST(Minmax, Keeps_the_extremes_since_the_start_or_the_reset) {
    Instance minmax("minmax");
    const auto feed = [&](double in) {
        minmax.set("in", in);
        minmax.run();
        return std::pair{minmax.get<double>("min"), minmax.get<double>("max")};
    };
    EXPECT_EQ(feed(5.0), std::pair(0.0, 5.0));
    EXPECT_EQ(feed(-1.0), std::pair(-1.0, 5.0));
    EXPECT_EQ(feed(nan), std::pair(-1.0, 5.0));
    EXPECT_EQ(feed(7.0), std::pair(-1.0, 7.0));
    minmax.set("reset", true);
    EXPECT_EQ(feed(2.0), std::pair(2.0, 2.0));
    minmax.set("reset", false);
    EXPECT_EQ(feed(3.0), std::pair(2.0, 3.0));
}

TEST(Deadzone, Subtracts_half_of_the_threshold_outside_of_the_zone) {
    Instance zone("deadzone");
    zone.set("center", 2.0);
    for (const auto& [in, out] :
         {std::pair{2.25, 2.0}, {2.5, 2.0}, {3.0, 2.5}, {1.5, 2.0}, {1.0, 1.5}, {nan, 2.0}}) {
        EXPECT_EQ(after(zone, in), out) << in;
    }
}

TEST(Blend, Interpolates_and_limits_unless_open) {
    Instance blend("blend");
    blend.set("in2", 10.0);
    blend.set("in1", 20.0);
    for (const auto& [select, out] :
         {std::pair{0.0, 10.0}, {0.25, 12.5}, {1.0, 20.0}, {1.5, 20.0}, {-1.0, 10.0}}) {
        EXPECT_EQ(after(blend, select, "select"), out);
    }
    blend.set("open", true);
    for (const auto& [select, out] : {std::pair{1.5, 25.0}, {-1.0, 0.0}}) {
        EXPECT_EQ(after(blend, select, "select"), out);
    }
}

TEST(Invert, Is_limited_near_zero) {
    Instance invert("invert");
    EXPECT_EQ(after(invert, 4.0), 0.25);
    EXPECT_EQ(after(invert, 0.0), 1e12);
    EXPECT_EQ(after(invert, -1e-20), -1e12);
    EXPECT_EQ(invert.get<double>("deadband"), 1e-12);
    invert.set("deadband", 0.5);
    EXPECT_EQ(after(invert, -0.25), -2.0);
    EXPECT_EQ(after(invert, -2.0), -0.5);
}

}  // namespace
