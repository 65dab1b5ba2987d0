// SPDX-License-Identifier: MIT
// Mobile robots: triangulation with its degenerate geometry, simulated sensors against values
// computed by hand, the files they read.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <numbers>
#include <random>

#include "components/mobile/triangulation.hpp"
#include "unit/components/component_host.hpp"

namespace {

using hal::mobile::Fix;
using hal::mobile::Place;
using hal::mobile::triangulate;
using hal::test::Instance;
using std::numbers::pi;

constexpr std::array<Place, 3> field{{{3.062, 1.05}, {-0.062, 2.162}, {-0.062, -0.062}}};

std::array<double, 3> bearings_at(const std::array<Place, 3>& beacons, double x, double y,
                                  double heading) {
    std::array<double, 3> b{};
    for (std::size_t i = 0; i < 3; ++i) {
        b[i] = std::atan2(beacons[i].y - y, beacons[i].x - x) - heading;
    }
    return b;
}

TEST(Triangulation, is_exact_over_the_field_in_any_heading) {
    for (double x = 0.1; x < 3.0; x += 0.1) {
        for (double y = 0.1; y < 2.1; y += 0.1) {
            for (const double heading : {-3.0, -1.0, 0.0, 0.5, 2.5}) {
                const Fix fix = triangulate(field, bearings_at(field, x, y, heading), 1e-6);
                ASSERT_TRUE(fix.valid) << x << ' ' << y;
                EXPECT_NEAR(fix.x, x, 1e-11);
                EXPECT_NEAR(fix.y, y, 1e-11);
                EXPECT_NEAR(std::remainder(fix.heading - heading, 2 * pi), 0.0, 1e-11);
            }
        }
    }
}

TEST(Triangulation, has_no_position_on_the_circle_through_the_beacons) {
    const std::array<Place, 3> unit{
        {{1, 0}, {std::cos(2.0), std::sin(2.0)}, {std::cos(4.0), std::sin(4.0)}}};
    for (const double at : {0.5, 3.0, 5.0}) {
        EXPECT_FALSE(
            triangulate(unit, bearings_at(unit, std::cos(at), std::sin(at), 0.3), 1e-6).valid)
            << at;
        // 5 cm beside it there is one, with a small D
        const Fix near = triangulate(
            unit, bearings_at(unit, 0.95 * std::cos(at), 0.95 * std::sin(at), 0.3), 1e-6);
        EXPECT_TRUE(near.valid) << at;
        EXPECT_NEAR(near.x, 0.95 * std::cos(at), 1e-9);
        EXPECT_LT(near.d, 10.0);
    }
    const Fix middle = triangulate(unit, bearings_at(unit, 0.0, 0.0, 0.3), 1e-6);
    EXPECT_NEAR(middle.x, 0.0, 1e-12);
}

TEST(Triangulation, survives_bearings_without_a_cotangent) {
    // on the line through beacons 1 and 2: between them the angle is pi, beyond them 0
    const std::array<Place, 3> square{{{0, 0}, {2, 0}, {1, 3}}};
    for (const double x : {0.5, 1.5, 3.0, -1.0}) {
        const Fix fix = triangulate(square, bearings_at(square, x, 0.0, 1.0), 1e-3);
        ASSERT_TRUE(fix.valid) << x;
        EXPECT_NEAR(fix.x, x, 1e-6);
        EXPECT_NEAR(fix.y, 0.0, 1e-6);
    }
    for (const double b : {0.0, pi, std::nan(""), 1e300, HUGE_VAL}) {
        const Fix fix = triangulate(square, {b, b, b}, 1e-3);
        EXPECT_TRUE(!fix.valid || std::isfinite(fix.x + fix.y + fix.heading)) << b;
    }
    // beacons on one point, and on a line with the robot
    EXPECT_FALSE(triangulate({{{1, 1}, {1, 1}, {1, 1}}}, {0.1, 0.2, 0.3}, 1e-3).valid);
    EXPECT_FALSE(triangulate({{{1, 0}, {2, 0}, {3, 0}}}, {0.0, 0.0, 0.0}, 1e-3).valid);
}

TEST(Triangulation, with_a_12_bit_head_is_a_few_millimetres_off_where_D_is_large) {
    std::mt19937 random(1);
    std::uniform_real_distribution<> xs(0.2, 2.8), ys(0.2, 1.9);
    std::vector<double> errors;
    for (int i = 0; i < 2000; ++i) {
        const double x = xs(random);
        const double y = ys(random);
        auto b = bearings_at(field, x, y, 0.0);
        for (double& one : b) {
            one = (std::floor(one / (2 * pi) * 4096) + 0.5) / 4096 * 2 * pi;
        }
        const Fix fix = triangulate(field, b, 0.5);
        if (fix.valid) {
            errors.push_back(std::hypot(fix.x - x, fix.y - y));
        }
    }
    std::sort(errors.begin(), errors.end());
    ASSERT_GT(errors.size(), 1900u);
    EXPECT_LT(errors[errors.size() / 2], 0.0015);
    EXPECT_LT(errors[errors.size() * 95 / 100], 0.008);
}

/// A file that exists as long as the test.
struct File {
    explicit File(const char* text) : path(testing::TempDir() + "mobile_test_file") {
        std::ofstream(path) << text;
    }
    ~File() { std::remove(path.c_str()); }
    std::string path;
};

TEST(SimInfrared, reads_what_the_law_gives_and_nothing_beyond_its_range) {
    const File file("wall 1 -5 1 5\ncircle 0 -0.82 0.1\n");
    Instance ring("sim_infrared", {{"floor", file.path}});
    ring.set("x", 0.5);
    ring.run("update", 500'000, 20);
    EXPECT_EQ(ring.get<std::uint32_t>("rings"), 1u);
    const double near = 1.0 - 0.5 - 0.22 + 0.05;
    EXPECT_EQ(ring.get<std::uint32_t>("value-00"), std::lround(40 / (near * near)));
    EXPECT_EQ(ring.get<std::uint32_t>("value-01"), ring.get<std::uint32_t>("value-00"));
    EXPECT_EQ(ring.get<std::uint32_t>("value-08"), 0u);  // backwards: nothing
    // side 2, 45 degrees to the left: sensor 3 stands 0.045 m to the left of its middle
    const double sx = 0.5 + (0.22 - 0.045) * std::sqrt(0.5);
    const double d = (1.0 - sx) * std::sqrt(2.0) + 0.05;
    EXPECT_EQ(ring.get<std::uint32_t>("value-03"), std::lround(40 * std::sqrt(0.5) / (d * d)));
    ring.set("x", -0.1);  // 0.88 m from the wall
    ring.run("update", 500'000, 20);
    EXPECT_EQ(ring.get<std::uint32_t>("value-00"), 0u);
    // the disc is below: side 7
    ring.set("x", 0.045);
    ring.run("update", 500'000, 20);
    EXPECT_GT(ring.get<std::uint32_t>("value-12") + ring.get<std::uint32_t>("value-13"), 100u);
}

TEST(SimUltrasound, gives_a_burst_of_32_messages_with_the_echo_at_its_distance) {
    const File file("wall 2 -5 2 5\n");
    Instance head("sim_ultrasound", {{"floor", file.path}}), echo("echo_range");
    for (const char* pin : {"begins", "step", "id-offset"}) {
        head.link(pin, echo, pin);
    }
    head.link("message", echo, "new");
    for (int i = 0; i < 8; ++i) {
        head.link("sample-" + std::to_string(i), echo, "sample-" + std::to_string(i));
    }
    int messages = 0;
    for (int i = 0; i < 100; ++i) {
        head.run("update", 500'000);
        echo.run("update", 500'000);
        messages += head.get<bool>("message");
    }
    EXPECT_EQ(messages, 32);
    EXPECT_EQ(echo.get<std::uint32_t>("bursts"), 1u);
    EXPECT_NEAR(echo.get<double>("range"), 2.0, 0.02);
    EXPECT_EQ(echo.get<std::uint32_t>("incomplete"), 0u);
}

TEST(SimDiffBase, stops_at_a_wall_and_its_wheels_slip) {
    const File file("wall 1 -5 1 5\n");
    Instance body("sim_diff_base", {{"floor", file.path}});
    for (int i = 0; i <= 1000; ++i) {
        body.set("left-angle", i * 0.05);
        body.set("right-angle", i * 0.05);
        body.run("update");
    }
    EXPECT_TRUE(body.get<bool>("contact"));
    EXPECT_EQ(body.get<std::uint32_t>("contacts"), 1u);
    EXPECT_NEAR(body.get<double>("x"), 0.85, 0.003);
    EXPECT_GE(body.get<double>("clearance"), 0.0);
    for (int i = 1000; i >= 0; --i) {  // back is free
        body.set("left-angle", i * 0.05);
        body.set("right-angle", i * 0.05);
        body.run("update");
    }
    EXPECT_FALSE(body.get<bool>("contact"));
    EXPECT_LT(body.get<double>("x"), -1.0);
}

struct Motor : Instance {
    Motor() : Instance("sim_hctl1100") { set("on", true); }
    /// Runs `ms` milliseconds; returns the counts moved per sample of 1.024 ms, averaged over the
    /// last 102.4 ms.
    double speed_after(int ms) {
        run("update", 1'024'000, static_cast<std::uint64_t>(ms));
        const auto before = get<std::int32_t>("counts");
        run("update", 1'024'000, 100);
        return (get<std::int32_t>("counts") - before) / 100.0;
    }
};

TEST(SimHctl1100, keeps_the_speed_exactly_in_integral_mode_and_not_in_proportional_mode) {
    Motor integral, proportional;
    integral.set("mode", 3);
    proportional.set("mode", 2);
    for (Motor* motor : {&integral, &proportional}) {
        motor->set("velocity-cmd", 20 * 16 + 8);
    }
    EXPECT_NEAR(integral.speed_after(3000), 20.0, 0.1);  // the fraction is lost
    const double slow = proportional.speed_after(3000);
    EXPECT_GT(slow, 10.0);
    EXPECT_LT(slow, 18.0);
}

TEST(SimHctl1100, goes_to_a_target_with_and_without_a_profile) {
    Motor profile, jump;
    profile.set("mode", 4);
    profile.set("velocity-cmd", 20 * 16);
    jump.set("mode", 1);
    for (Motor* motor : {&profile, &jump}) {
        motor->set("target", 5000);
    }
    profile.run("update", 1'024'000, 100);
    EXPECT_FALSE(profile.get<bool>("profile-done"));
    EXPECT_LE(profile.get<double>("speed") * 20000 / (2 * pi) * 1.024e-3, 21.0);
    jump.run("update", 1'024'000, 3000);
    profile.run("update", 1'024'000, 3000);
    EXPECT_TRUE(profile.get<bool>("profile-done"));
    for (Motor* motor : {&profile, &jump}) {
        EXPECT_NEAR(motor->get<std::int32_t>("counts"), 5000, 20);
    }
}

TEST(SimHctl1100, reports_a_stall_and_a_following_error) {
    Motor motor;
    motor.set("mode", 3);
    motor.set("velocity-cmd", 26 * 16);
    motor.set("held", true);
    motor.run("update", 1'024'000, 1000);
    EXPECT_TRUE(motor.get<bool>("stalled"));
    EXPECT_TRUE(motor.get<bool>("following-error"));
    motor.set("on", false);
    motor.run("update", 1'024'000, 2);
    EXPECT_FALSE(motor.get<bool>("stalled"));
}

TEST(SampledPid, computes_once_per_sample_and_holds_an_output_back) {
    Instance loop("sampled_pid");
    loop.set("gain", 2.0);
    loop.set("command", 1.0);
    loop.set("delay", 0.003);
    loop.set("trigger", true);
    loop.run("update");
    loop.set("trigger", false);
    EXPECT_EQ(loop.get<double>("output"), 0.0);
    loop.run("update", 1'000'000, 2);
    EXPECT_FALSE(loop.get<bool>("new"));
    loop.run("update");
    EXPECT_TRUE(loop.get<bool>("new"));
    EXPECT_EQ(loop.get<double>("output"), 2.0);
    loop.run("update");
    EXPECT_FALSE(loop.get<bool>("new"));
}

TEST(SampleClock, measures_the_delay_of_each_sample) {
    Instance clock("sample_clock");
    // every fifth cycle a sample, whose effect comes after one or two cycles in turn
    for (int i = 0; i < 100; ++i) {
        clock.run("sample");
        const auto number = clock.get<std::uint32_t>("sequence");
        const bool late = number % 2 == 0;
        clock.set("echo-new", i % 5 == (late ? 2 : 1));
        clock.set("echo", number);
        clock.set("period", 0.01);
        clock.run("measure");
    }
    EXPECT_GT(clock.get<std::uint32_t>("measured"), 5u);
    EXPECT_GT(clock.get<double>("jitter"), 0.0);
    EXPECT_EQ(clock.get<std::uint32_t>("overtaken"), 0u);
}

}  // namespace
