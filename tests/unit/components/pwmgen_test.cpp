// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <string>

#include "unit/components/component_host.hpp"

namespace {

using hal::test::Instance;

constexpr std::int64_t base_ns = 50'000;
constexpr std::int64_t servo_ns = 1'000'000;

struct Pwm : Instance {
    explicit Pwm(const char* type = "1") : Instance("pwmgen", {{"output_type", type}}) {
        set("enable", true);
        make();
    }
    void make() { run("make-pulses", base_ns); }
    void update() { run("update", servo_ns); }
    /// Part of the time `pin` is high over `cycles` fast cycles, with an update every 20 as at 1
    /// kHz.
    double average(const char* pin, int cycles = 20'000) {
        int high = 0;
        for (int i = 0; i < cycles; ++i) {
            if (i % 20 == 0) {
                update();
            }
            make();
            high += get<bool>(pin) ? 1 : 0;
        }
        return static_cast<double>(high) / cycles;
    }
};

TEST(Pwmgen, Pwm_has_the_duty_rounded_to_whole_ticks) {
    Pwm p;
    p.set("pwm-freq", 1000.0);  // 20 ticks
    p.set("scale", 24.0);
    p.set("value", -24.0 * 0.33);
    EXPECT_DOUBLE_EQ(p.average("pwm"), 7.0 / 20);
    EXPECT_DOUBLE_EQ(p.get<double>("curr-dc"), -7.0 / 20);
    EXPECT_TRUE(p.get<bool>("dir"));
    p.set("value", 24.0 * 0.75);
    EXPECT_DOUBLE_EQ(p.average("pwm"), 0.75);
    EXPECT_FALSE(p.get<bool>("dir"));
}

TEST(Pwmgen, Frequency_becomes_one_that_can_be_made) {
    Pwm p;
    p.set("pwm-freq", 3000.0);
    p.update();
    EXPECT_DOUBLE_EQ(p.get<double>("pwm-freq"), 20'000.0 / 7);
    p.update();
    EXPECT_DOUBLE_EQ(p.get<double>("pwm-freq"), 20'000.0 / 7);  // it does not wander
    p.set("pwm-freq", 1e6);
    p.update();
    EXPECT_DOUBLE_EQ(p.get<double>("pwm-freq"), 10'000.0);
    p.set("dither-pwm", true);
    p.set("pwm-freq", 3000.0);
    p.update();
    EXPECT_DOUBLE_EQ(p.get<double>("pwm-freq"), 3000.0);
}

TEST(Pwmgen, Dithered_pwm_is_exact_in_the_average_and_keeps_its_frequency) {
    Pwm p;
    p.set("dither-pwm", true);
    p.set("pwm-freq", 3000.0);
    p.set("value", 0.4321);
    EXPECT_NEAR(p.average("pwm"), 0.4321, 1e-3);
    EXPECT_DOUBLE_EQ(p.get<double>("curr-dc"), 0.4321);
    int rises = 0;
    bool before = true;
    for (int i = 0; i < 20'000; ++i) {
        if (i % 50 == 0) {
            p.update();
        }
        p.make();
        rises += p.get<bool>("pwm") && !before ? 1 : 0;
        before = p.get<bool>("pwm");
    }
    EXPECT_NEAR(rises, 3000, 2);
}

TEST(Pwmgen, Pdm_is_exact_in_the_average_and_evenly_spread) {
    Pwm p;
    p.set("value", 0.2);
    EXPECT_NEAR(p.average("pwm"), 0.2, 1e-4);
    int gap = 0;
    for (int i = 0; i < 1000; ++i) {
        p.make();
        if (p.get<bool>("pwm")) {
            gap = 0;
        } else {
            ASSERT_LE(++gap, 4);
        }
    }
    p.set("value", 1.0);
    EXPECT_DOUBLE_EQ(p.average("pwm", 100), 1.0);
    p.set("value", 0.0);
    EXPECT_LE(p.average("pwm", 100), 0.01);
}

TEST(Pwmgen, Direction_and_level_of_a_tick_belong_together) {
    for (const char* type : {"1", "2"}) {
        Pwm p(type);
        for (const double value : {1.0, -1.0, 1.0}) {
            p.set("value", value);
            p.update();
            p.make();
            EXPECT_EQ(p.get<bool>(type[0] == '1' ? "dir" : "down"), value < 0.0) << type;
        }
    }
}

TEST(Pwmgen, Limits_and_offset_bound_the_duty) {
    Pwm p;
    p.set("max-dc", 0.9);
    p.set("min-dc", 0.1);
    struct Case {
        double value, offset, duty;
    };
    for (const Case c : {Case{2.0, 0, 0.9}, Case{0.0, 0, 0.1}, Case{-0.05, 0, -0.1},
                         Case{-3.0, 0, -0.9}, Case{0.3, 0.2, 0.5}, Case{-0.3, 0.1, -0.2}}) {
        p.set("value", c.value);
        p.set("offset", c.offset);
        p.update();
        EXPECT_NEAR(p.get<double>("curr-dc"), c.duty, 1e-12) << c.value;
    }
    p.set("min-dc", 5.0);
    p.set("max-dc", -1.0);
    p.update();
    EXPECT_EQ(p.get<double>("max-dc"), 0.0);
    EXPECT_EQ(p.get<double>("min-dc"), 0.0);
}

TEST(Pwmgen, Disabled_or_not_a_number_is_off_at_once) {
    Pwm p;
    p.set("value", 1.0);
    p.set("min-dc", 0.5);
    EXPECT_DOUBLE_EQ(p.average("pwm", 20), 1.0);
    p.set("enable", false);
    p.update();
    p.make();
    EXPECT_FALSE(p.get<bool>("pwm"));
    EXPECT_EQ(p.get<double>("curr-dc"), 0.0);
    p.set("enable", true);
    p.set("value", std::nan(""));
    EXPECT_DOUBLE_EQ(p.average("pwm", 100), 0.0);
}

TEST(Pwmgen, Up_and_down_share_the_work) {
    Pwm p("2");
    EXPECT_FALSE(p.has_pin("pwm"));
    p.set("value", 0.25);
    EXPECT_NEAR(p.average("up"), 0.25, 1e-3);
    EXPECT_EQ(p.average("down", 100), 0.0);
    p.set("value", -0.75);
    EXPECT_NEAR(p.average("down"), 0.75, 1e-3);
    EXPECT_EQ(p.average("up", 100), 0.0);
}

TEST(Pwmgen, Single_output_gives_nothing_for_negative_values) {
    Pwm p("0");
    EXPECT_FALSE(p.has_pin("dir"));
    p.set("value", -0.5);
    EXPECT_EQ(p.average("pwm", 100), 0.0);
    EXPECT_THROW(Pwm("3"), std::runtime_error);
}

}  // namespace
