// SPDX-License-Identifier: MIT
// What a netlist cannot test of the supervising components and the plants: the host's safe values,
// random states, random parameters.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "unit/components/component_host.hpp"

namespace {

using hal::test::Instance;
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

void press(Instance& instance) {
    instance.run(1);
    instance.set("reset", true);
    instance.run(1);
    instance.set("reset", false);
    instance.run(1);
}

// The host writes the declared safe value on stop and on a stopping fault; then the function runs
// again.
TEST(Supervision, After_a_stop_of_the_runtime_a_reset_is_needed) {
    Instance guard("safe_limit");
    press(guard);
    ASSERT_TRUE(guard.get<bool>("power"));
    guard.set("power", false);
    guard.run(3);
    EXPECT_FALSE(guard.get<bool>("power"));
    EXPECT_EQ(guard.get<std::uint32_t>("reason"), 9u);
    press(guard);
    EXPECT_TRUE(guard.get<bool>("power"));

    Instance lock("interlock");
    for (const char* in :
         {"in-00", "in-01", "in-02", "in-03", "in-04", "in-05", "in-06", "in-07"}) {
        lock.set(in, true);
    }
    press(lock);
    ASSERT_TRUE(lock.get<bool>("ok"));
    lock.set("ok", false);
    lock.run(3);
    EXPECT_FALSE(lock.get<bool>("ok"));
    EXPECT_TRUE(lock.get<bool>("ready-to-reset"));
    press(lock);
    EXPECT_TRUE(lock.get<bool>("ok"));

    Instance dual("dual_channel");
    dual.run(1);
    ASSERT_TRUE(dual.get<bool>("ok"));
    dual.set("ok", false);
    dual.run(3);
    EXPECT_FALSE(dual.get<bool>("ok"));
    EXPECT_EQ(dual.get<std::uint32_t>("reason"), 6u);
    press(dual);
    EXPECT_TRUE(dual.get<bool>("ok"));

    Instance beat("heartbeat_monitor");
    const auto beats = [&](int count) {
        for (int i = 0; i < count; ++i) {
            beat.set("toggle", !beat.get<bool>("toggle"));
            beat.run(5);
        }
    };
    beats(5);
    ASSERT_TRUE(beat.get<bool>("ok"));
    beat.set("ok", false);
    beats(5);
    EXPECT_FALSE(beat.get<bool>("ok"));
    EXPECT_EQ(beat.get<std::uint32_t>("reason"), 7u);
    press(beat);
    beats(3);
    EXPECT_TRUE(beat.get<bool>("ok"));
}

// An axis that follows command-out, a command and limits that change at random: it never passes
// what a stop 1 takes.
TEST(SafeLimit, An_axis_that_obeys_stays_within_its_limits_and_the_way_to_stop) {
    for (unsigned seed = 0; seed < 20; ++seed) {
        std::mt19937 random(seed);
        std::uniform_real_distribution<double> unit(-1.0, 1.0);
        Instance guard("safe_limit");
        guard.set("max-speed", 2.0);
        guard.set("min-position", -1.0);
        guard.set("max-position", 1.0);
        guard.set("stop-deceleration", 10.0);
        guard.set("speed-reaction", 2);
        double position = 0.0;
        for (int cycle = 0; cycle < 20'000; ++cycle) {
            if (cycle % 200 == 0) {
                guard.set("command", 4 * unit(random));
            }
            guard.set("reset", cycle % 500 == 499);
            guard.set("position", position);
            guard.run(1);
            const double speed = guard.get<double>("command-out");
            ASSERT_LE(std::fabs(speed), 2.0);
            ASSERT_TRUE(guard.get<bool>("power") || speed == 0.0);
            position += 1e-3 * speed;
            // 2^2 / (2 * 10) to stop, and two cycles to see it
            ASSERT_LE(std::fabs(position), 1.0 + 0.2 + 0.004)
                << "seed " << seed << " cycle " << cycle;
        }
    }
}

TEST(SafeLimit, Takes_the_power_in_the_cycle_of_a_value_that_is_not_a_number) {
    for (const char* pin :
         {"position", "max-speed", "min-position", "stop-time", "standstill-time"}) {
        Instance guard("safe_limit");
        press(guard);
        ASSERT_TRUE(guard.get<bool>("power"));
        guard.set(pin, nan);
        guard.run(1);
        EXPECT_FALSE(guard.get<bool>("power")) << pin;
    }
}

// Odometry against the integral of the motion in fine steps, for speeds that are constant in each
// cycle.
TEST(DiffDrive, Pose_does_not_depend_on_the_length_of_the_cycle) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    Instance coarse("diff_drive"), fine("diff_drive");
    coarse.run("odometry");
    fine.run("odometry");
    double left = 0.0;
    double right = 0.0;
    for (int cycle = 0; cycle < 1000; ++cycle) {
        const double l = unit(random);
        const double r = unit(random);
        for (int part = 0; part < 50; ++part) {
            left += l / 50;
            right += r / 50;
            fine.set("left-angle", left);
            fine.set("right-angle", right);
            fine.run("odometry", 1'000'000);
        }
        coarse.set("left-angle", left);
        coarse.set("right-angle", right);
        coarse.run("odometry", 50'000'000);
    }
    for (const char* pin : {"x", "y", "turned", "distance"}) {
        EXPECT_NEAR(coarse.get<double>(pin), fine.get<double>(pin), 1e-9) << pin;
    }
}

// What is commanded is what is measured: wheels that obey drive the wanted curve.
TEST(DiffDrive, Command_and_odometry_are_inverse) {
    Instance base("diff_drive");
    base.set("left-radius", 0.03);
    base.set("right-radius", 0.05);
    base.set("linear", 0.7);
    base.set("angular", -1.3);
    double left = 0.0;
    double right = 0.0;
    for (int cycle = 0; cycle < 100; ++cycle) {
        base.run("odometry");
        base.run("command");
        left += 1e-3 * base.get<double>("left-speed");
        right += 1e-3 * base.get<double>("right-speed");
        base.set("left-angle", left);
        base.set("right-angle", right);
    }
    base.run("odometry");
    EXPECT_NEAR(base.get<double>("actual-linear"), 0.7, 1e-9);
    EXPECT_NEAR(base.get<double>("actual-angular"), -1.3, 1e-9);
}

TEST(TwoMass, Keeps_its_energy_without_friction_for_any_period) {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> magnitude(-4.0, 2.0);
    for (int trial = 0; trial < 100; ++trial) {
        Instance plant("two_mass");
        const auto any = [&] { return std::pow(10.0, magnitude(random)); };
        const double j1 = any();
        const double j2 = any();
        const double c = 100.0 * any();
        plant.set("motor-inertia", j1);
        plant.set("load-inertia", j2);
        plant.set("stiffness", c);
        for (const char* none : {"damping", "motor-viscous", "load-viscous"}) {
            plant.set(none, 0.0);
        }
        plant.set("torque", 1.0);
        plant.run("update", 10'000'000);
        plant.set("torque", 0.0);
        const auto energy = [&] {
            const double w1 = plant.get<double>("motor-velocity");

            const double w2 = plant.get<double>("load-velocity");
            const double twist = plant.get<double>("twist");
            return (j1 * w1 * w1 + j2 * w2 * w2 + c * twist * twist) / 2;
        };
        const double start = energy();
        for (const std::int64_t period : {50'000, 1'000'000, 37'000'000}) {
            plant.run("update", period, 2000);
            ASSERT_NEAR(energy(), start, 1e-7 * start) << "trial " << trial << " period " << period;
        }
    }
}

TEST(Plants, Come_to_rest_with_friction_for_any_parameters) {
    std::mt19937 random(6);
    std::uniform_real_distribution<double> magnitude(-9.0, 12.0);
    const auto any = [&] { return std::pow(10.0, magnitude(random)); };
    for (int trial = 0; trial < 500; ++trial) {
        Instance two("two_mass"), one("spring_damper");
        for (const char* pin : {"motor-inertia", "load-inertia", "stiffness", "damping",
                                "motor-viscous", "load-viscous"}) {
            two.set(pin, any());
        }
        for (const char* pin : {"mass", "stiffness", "damping"}) {
            one.set(pin, any());
        }
        two.set("torque", 1.0);
        two.run("update");
        two.set("torque", 0.0);
        one.set("force", 1.0);
        const double first = std::fabs(two.get<double>("motor-velocity")) +
                             std::fabs(two.get<double>("load-velocity"));
        for (int cycle = 0; cycle < 200; ++cycle) {
            two.run("update", 100'000'000);
            one.run("update", 100'000'000);
            const double w1 = two.get<double>("motor-velocity");

            const double w2 = two.get<double>("load-velocity");
            // Each speed is bounded by the energy of the first push, whatever shares of it the
            // other mass takes.
            ASSERT_TRUE(std::isfinite(w1) && std::isfinite(w2) &&
                        std::isfinite(one.get<double>("position")))
                << "trial " << trial;
            ASSERT_LT(std::fabs(w1), 1e12 * (first + 1e-12)) << "trial " << trial;
        }
    }
}

TEST(Noise, Neighbouring_seeds_are_not_alike) {
    Instance a("noise"), b("noise");
    b.set("seed", 1);
    double product = 0.0;
    double power = 0.0;
    for (int i = 0; i < 20'000; ++i) {
        a.run(1);
        b.run(1);
        product += a.get<double>("out") * b.get<double>("out");
        power += a.get<double>("out") * a.get<double>("out");
    }
    EXPECT_LT(std::fabs(product), 0.05 * power);
}

}  // namespace
