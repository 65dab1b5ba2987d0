// SPDX-License-Identifier: MIT
// Properties of the paths for random limits, targets and states; the component's own behaviour is
// in tests/netlists/motion_profile.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "components/motion/profile.hpp"
#include "unit/components/component_host.hpp"

namespace {

using hal::test::Instance;
using motion::Limits;
using motion::Path;
using motion::State;

struct Random {
    std::mt19937_64 bits;
    explicit Random(unsigned seed) : bits(seed) {}
    double between(double a, double b) {
        return std::uniform_real_distribution<double>(a, b)(bits);
    }
    double of_magnitude(double a, double b) { return std::pow(10.0, between(a, b)); }
    Limits limits(bool equal) {
        const double jerk = between(0, 1) < 0.2 ? motion::unlimited : of_magnitude(-2, 3);
        Limits l{of_magnitude(-2, 2), of_magnitude(-2, 2), of_magnitude(-2, 2), jerk};
        if (equal) {
            l.deceleration = l.acceleration;
        }
        return l;
    }
};

/// The share by which a path is beyond its limits anywhere.
double excess(const Path& path, const Limits& limits) {
    double worst = -1.0;
    double jerk = 0.0;
    for (int i = 0; i <= 200; ++i) {
        const State s = path.at(path.duration() * i / 200 * (1 - 1e-13), jerk);
        const bool at_rest = std::fabs(s.velocity) < 1e-9 * limits.velocity;
        const double min =
            s.velocity * s.acceleration >= 0.0 ? limits.acceleration : limits.deceleration;
        const double max = at_rest ? std::max(limits.acceleration, limits.deceleration) : min;
        worst = std::max({worst, std::fabs(s.velocity) / limits.velocity - 1,
                          std::fabs(s.acceleration) / max - 1, std::fabs(jerk) / limits.jerk - 1});
    }
    return worst;
}

/// How far before its end a path is from its target, against its size.
double miss(const Path& path, double target) {
    double jerk = 0.0;
    double size = std::fabs(target);
    for (int i = 0; i <= 20; ++i) {
        size = std::max(size, std::fabs(path.at(path.duration() * i / 20, jerk).position));
    }
    const State s = path.at(path.duration() * (1 - 1e-13), jerk);
    return std::fabs(s.position - target) /
           (size + std::fabs(s.velocity) * path.duration() + 1e-300);
}

TEST(MotionProfile, Every_path_keeps_the_limits_and_arrives_wherever_it_is_interrupted) {
    Random random(1);
    for (int trial = 0; trial < 20'000; ++trial) {
        const Limits limits = random.limits(random.between(0, 1) < 0.5);
        const double size = random.of_magnitude(-6, 3);
        State start{size * random.between(-1, 1), 0, 0};
        for (int change = 0; change < 4; ++change) {
            const double target = size * random.between(-1, 1);
            const Path path = motion::path_to_position(start, target, limits);
            ASSERT_LT(excess(path, limits), 1e-9) << "trial " << trial;
            ASSERT_LT(miss(path, target), 1e-12) << "trial " << trial;
            ASSERT_EQ(path.end().position, target);
            ASSERT_EQ(path.end().velocity, 0.0);
            ASSERT_EQ(path.end().acceleration, 0.0);
            double jerk = 0.0;
            start = path.at(path.duration() * random.between(0, 1), jerk);
        }
    }
}

TEST(MotionProfile, Limits_changed_on_the_way_are_recovered_and_the_target_reached) {
    Random random(2);
    for (int trial = 0; trial < 20'000; ++trial) {
        State start{random.between(-1, 1), 0, 0};
        for (int change = 0; change < 4; ++change) {
            const Limits limits = random.limits(false);
            const double target = random.between(-1, 1);
            const Path path = motion::path_to_position(start, target, limits);
            ASSERT_LT(miss(path, target), 1e-11) << "trial " << trial;
            double jerk = 0.0;
            double speed = std::fabs(start.velocity);
            const double max =
                std::max({speed, std::fabs(Path(start, limits.jerk).settled()), limits.velocity});
            for (int i = 0; i <= 100; ++i) {
                speed =
                    std::max(speed, std::fabs(path.at(path.duration() * i / 100, jerk).velocity));
            }
            // a start beyond a limit of acceleration takes the settled speed with it, and no more
            ASSERT_LT(speed, max * (1 + 1e-9)) << "trial " << trial;
            start = path.at(path.duration() * random.between(0, 1), jerk);
        }
    }
}

/// The time from rest to rest over `x` by the closed forms of Biagiotti and Melchiorri, 3.2.4 and
/// 3.4.
double fastest(double x, const Limits& l) {
    const double v = l.velocity;
    const double a = l.acceleration;
    const double j = l.jerk;
    if (!(j < motion::unlimited)) {
        const double d = l.deceleration;
        const double w = std::min(v, std::sqrt(2 * x * a * d / (a + d)));
        return w / a + w / d + (x - w * w / 2 * (1 / a + 1 / d)) / w;
    }
    const auto ramp = [&](double w) {
        return w * j >= a * a ? w / a + a / j : 2 * std::sqrt(w / j);
    };
    if (x >= v * ramp(v)) return x / v + ramp(v);
    if (x <= 2 * a * a * a / (j * j)) return 4 * std::cbrt(x / (2 * j));
    // w (w / a + a / j) = x, and twice the ramp
    return a / j + std::sqrt(a * a / (j * j) + 4 * x / a);
}

TEST(MotionProfile, From_rest_to_rest_it_takes_the_time_of_the_closed_form) {
    Random random(3);
    for (int trial = 0; trial < 20'000; ++trial) {
        Limits limits = random.limits(true);
        if (!(limits.jerk < motion::unlimited)) {
            limits.deceleration = random.of_magnitude(-2, 2);
        }
        const double x = random.of_magnitude(-6, 4);
        for (const double target : {x, -x}) {
            const double found = motion::path_to_position({}, target, limits).duration();

            const double expected = fastest(x, limits);
            ASSERT_NEAR(found, expected, 1e-9 * expected) << "trial " << trial << " " << x;
        }
    }
}

// Bellman's principle: the rest of a fastest path is the fastest path of the rest.
TEST(MotionProfile, A_path_made_anew_on_the_way_takes_as_long_as_what_was_left) {
    Random random(4);
    for (int trial = 0; trial < 20'000; ++trial) {
        const Limits limits = random.limits(true);
        State start{random.between(-1, 1), 0, 0};
        for (int change = 0; change < 4; ++change) {
            const double target = random.between(-1, 1);
            const Path path = motion::path_to_position(start, target, limits);
            const double gone = path.duration() * random.between(0, 1);
            double jerk = 0.0;
            start = path.at(gone, jerk);
            const Path rest = motion::path_to_position(start, target, limits);
            ASSERT_NEAR(rest.duration(), path.duration() - gone, 1e-3 * path.duration() + 1e-6)
                << "trial " << trial;
        }
    }
}

// No admissible jerk, held for any while before the fastest path is taken, arrives sooner. Put one
// after another, such whiles make up every admissible motion, so none of them is faster: with the
// test above this is optimality itself.
TEST(MotionProfile, No_detour_is_faster) {
    Random random(7);
    int tried = 0;
    for (int trial = 0; trial < 40'000; ++trial) {
        Limits limits = random.limits(true);
        if (!(limits.jerk < motion::unlimited)) {
            limits.jerk = 1.0;
        }
        State start{random.between(-1, 1), 0, 0};
        double jerk = 0.0;
        for (int change = 0; change < 2; ++change) {
            const Path path = motion::path_to_position(start, random.between(-1, 1), limits);
            start = path.at(path.duration() * random.between(0, 1), jerk);
        }
        const double target = random.between(-1, 1);

        const double fastest = motion::path_to_position(start, target, limits).duration();
        const double held = random.between(-1, 1) < 0.0   ? -limits.jerk
                            : random.between(-1, 1) < 0.0 ? 0.0
                                                          : limits.jerk;
        const double time = fastest * random.of_magnitude(-3, -0.3);
        bool admissible = true;
        for (int i = 1; i <= 50 && admissible; ++i) {
            const State s = start.after(time * i / 50, held);
            admissible = std::fabs(s.acceleration) <= limits.acceleration &&
                         std::fabs(s.velocity) <= limits.velocity &&
                         std::fabs(Path(s, limits.jerk).settled()) <= limits.velocity;
        }
        if (!admissible) continue;
        ++tried;
        const double detour =
            time + motion::path_to_position(start.after(time, held), target, limits).duration();
        ASSERT_GE(detour, fastest * (1 - 1e-6) - 1e-9) << "trial " << trial;
    }
    EXPECT_GT(tried, 5'000);
}

TEST(MotionProfile, Speed_is_reached_within_the_limits_through_0_too) {
    Random random(5);
    for (int trial = 0; trial < 20'000; ++trial) {
        const Limits limits = random.limits(random.between(0, 1) < 0.5);
        State start{};
        for (int change = 0; change < 4; ++change) {
            const double wanted = limits.velocity * random.between(-1.2, 1.2);
            const Path path = motion::path_to_velocity(start, wanted, limits);
            ASSERT_LT(excess(path, limits), 1e-9) << "trial " << trial;
            ASSERT_EQ(path.end().velocity, std::clamp(wanted, -limits.velocity, limits.velocity));
            double jerk = 0.0;
            start = path.at(path.duration() * random.between(0, 1), jerk);
        }
    }
}

TEST(MotionProfile, Extremes_stay_finite) {
    Random random(6);
    for (int trial = 0; trial < 20'000; ++trial) {
        const auto any = [&] { return random.of_magnitude(-300, 300); };
        State start{random.between(-1, 1), 0, 0};
        for (int change = 0; change < 4; ++change) {
            Limits limits;
            ASSERT_TRUE(Limits::from(any(), any(), any(), any(), limits));
            const Path path =
                motion::path_to_position(start, motion::farthest * random.between(-1, 1), limits);
            ASSERT_TRUE(std::isfinite(path.duration()));
            double jerk = 0.0;
            const State next = path.at(path.duration() * random.between(0, 1), jerk);
            ASSERT_TRUE(std::isfinite(next.position) && std::isfinite(next.velocity) &&
                        std::isfinite(next.acceleration));
            start = std::fabs(next.position) < motion::farthest ? next : State{};
        }
    }
    Limits limits;
    const double nan = std::numeric_limits<double>::quiet_NaN();
    for (const double bad : {0.0, -1.0, nan}) {
        EXPECT_FALSE(Limits::from(bad, 1, 1, 1, limits));
        EXPECT_FALSE(Limits::from(1, bad, 1, 1, limits));
    }
    EXPECT_FALSE(Limits::from(1, 1, nan, 1, limits));
    EXPECT_FALSE(Limits::from(1, 1, 1, -1, limits));
}

// As a user sees it: samples of a period, targets and limits at random moments.
TEST(MotionProfile, Samples_of_position_keep_the_limits_while_targets_change) {
    for (unsigned seed = 0; seed < 20; ++seed) {
        Random random(seed);
        Instance profile("motion_profile");
        const double v = random.of_magnitude(-1, 2);
        const double a = random.of_magnitude(0, 3);

        const double j = random.of_magnitude(1, 5);
        const double dt = 1e-3;
        profile.set("max-velocity", v);
        profile.set("max-acceleration", a);
        profile.set("max-jerk", j);
        double target = 0.0;
        double p1 = 0.0;
        double p2 = 0.0;
        double p3 = 0.0;
        for (int cycle = 0; cycle < 5000; ++cycle) {
            if (random.between(0, 1) < 0.01) {
                profile.set("target", target = 10 * random.between(-1, 1));
            }
            profile.run(1);
            const double p = profile.get<double>("position");
            const double rounding = 1e-13 * (1 + std::fabs(p));
            ASSERT_LE(std::fabs(p - p1), v * dt * (1 + 1e-9) + rounding)
                << seed << " cycle " << cycle;
            ASSERT_LE(std::fabs(p - 2 * p1 + p2), a * dt * dt * (1 + 1e-9) + rounding)
                << seed << " cycle " << cycle;
            ASSERT_LE(std::fabs(p - 3 * p1 + 3 * p2 - p3),
                      j * dt * dt * dt * (1 + 1e-9) + 4 * rounding)
                << seed << " cycle " << cycle;
            p3 = p2;
            p2 = p1;
            p1 = p;
        }
        profile.run(static_cast<int>(1e3 * (40 / v + 2 * v / a + 2 * a / j) + 10));
        EXPECT_EQ(profile.get<double>("position"), target) << seed;
        EXPECT_TRUE(profile.get<bool>("done"));
    }
}

TEST(MotionProfile, Waits_on_an_input_that_is_not_a_number_and_goes_on) {
    Instance profile("motion_profile");
    profile.set("max-acceleration", 1e6);
    profile.set("target", 0.5);
    profile.run(100);
    profile.set("target", std::numeric_limits<double>::quiet_NaN());
    profile.run(500);
    EXPECT_EQ(profile.get<double>("position"), 0.5);
    profile.set("target", 0.25);
    profile.run(300);
    EXPECT_EQ(profile.get<double>("position"), 0.25);
}

}  // namespace
