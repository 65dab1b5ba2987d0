// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "unit/components/component_host.hpp"

namespace {

using hal::test::Instance;
constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr std::int64_t second = 1'000'000'000;

double after(Instance& instance, double in, std::int64_t period_ns = 1'000'000) {
    instance.set("in", in);
    instance.run("", period_ns);
    return instance.get<double>("out");
}

/// `out` of each of the next cycles of one second, with the input as it is.
std::vector<double> positions(Instance& instance, int cycles) {
    std::vector<double> out;
    for (int i = 0; i < cycles; ++i) {
        instance.run("", second);
        out.push_back(instance.get<double>("out"));
    }
    return out;
}

void expect_near(const std::vector<double>& found, const std::vector<double>& expected) {
    ASSERT_EQ(found.size(), expected.size());
    for (std::size_t i = 0; i < found.size(); ++i) {
        EXPECT_NEAR(found[i], expected[i], 1e-12) << "cycle " << i;
    }
}

TEST(Limit1, Keeps_its_input_between_min_and_max) {
    Instance limit("limit1");
    EXPECT_EQ(after(limit, 1e19), 1e19);
    limit.set("min", -1.0);
    limit.set("max", 2.0);
    EXPECT_EQ(after(limit, 0.5), 0.5);
    EXPECT_EQ(after(limit, -5.0), -1.0);
    EXPECT_EQ(after(limit, infinity), 2.0);
    EXPECT_TRUE(std::isnan(after(limit, nan)));
    EXPECT_EQ(after(limit, 1.0), 1.0);
}

TEST(Limit1, Max_wins_over_min) {
    Instance limit("limit1");
    limit.set("min", 3.0);
    limit.set("max", 1.0);
    for (const double in : {0.0, 2.0, 5.0}) {
        EXPECT_EQ(after(limit, in), 1.0);
    }
}

TEST(Limit2, Moves_by_at_most_maxv_per_second_and_arrives_exactly) {
    Instance limit("limit2");
    limit.set("maxv", 2.0);
    limit.set("max", 4.5);
    limit.set("in", 10.0);
    expect_near(positions(limit, 4), {2.0, 4.0, 4.5, 4.5});
    limit.set("in", 0.1);
    expect_near(positions(limit, 4), {2.5, 0.5, 0.1, 0.1});
    EXPECT_EQ(limit.get<double>("out"), 0.1);
}

TEST(Limit2, Load_jumps_and_bad_inputs_hold) {
    Instance limit("limit2");
    limit.set("maxv", 1.0);
    limit.set("load", true);
    EXPECT_EQ(after(limit, 50.0), 50.0);
    EXPECT_EQ(after(limit, nan), 50.0);
    limit.set("max", infinity);
    EXPECT_EQ(after(limit, infinity), 50.0);
    limit.set("load", false);
    EXPECT_EQ(after(limit, nan), 50.0);
    limit.set("maxv", -1.0);
    EXPECT_EQ(after(limit, 0.0), 50.0);
    limit.set("maxv", 1.0);
    EXPECT_EQ(after(limit, 0.0, second), 49.0);
}

TEST(Limit3, Accelerates_and_brakes_by_maxa) {
    Instance limit("limit3");
    limit.set("maxa", 1.0);
    limit.set("in", 9.0);
    expect_near(positions(limit, 7), {1, 3, 6, 8, 9, 9, 9});
    limit.set("in", 3.0);
    expect_near(positions(limit, 6), {8, 6, 4, 3, 3, 3});
}

TEST(Limit3, Cruises_at_maxv) {
    Instance limit("limit3");
    limit.set("maxa", 1.0);
    limit.set("maxv", 2.0);
    limit.set("in", 10.0);
    expect_near(positions(limit, 8), {1, 3, 5, 7, 9, 10, 10, 10});
}

// With m = smooth-steps - 1 = 3 and A = 1 the last displacements are 1, 1/3 (see the source),
// before them A more each.
TEST(Limit3, Smooth_steps_fades_the_braking_out) {
    Instance limit("limit3");
    limit.set("smooth-steps", 4);
    limit.set("maxa", 1.0);
    limit.set("in", 13.0 / 3.0);
    expect_near(positions(limit, 6), {1, 3, 4, 13.0 / 3.0, 13.0 / 3.0, 13.0 / 3.0});
}

// From rest to rest in n moves the most that can be covered is A k^2 for n = 2k - 1 and A k (k + 1)
// for n = 2k. Full acceleration in every cycle but the last ones makes up to two cycles more of it.
TEST(Limit3, Is_at_most_two_cycles_slower_than_the_fastest_way) {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> distances(0.01, 400.0);
    for (int trial = 0; trial < 200; ++trial) {
        const double distance = distances(random);
        int moves = 1;
        const auto reach = [](int n) {
            return n % 2 ? (n + 1) / 2 * ((n + 1) / 2) : n / 2 * (n / 2 + 1);
        };
        while (reach(moves) < distance) {
            ++moves;
        }

        Instance limit("limit3");
        limit.set("maxa", 1.0);
        int needed = 0;
        while (needed < 100 && after(limit, distance, second) != distance) {
            ++needed;
        }
        EXPECT_GE(needed + 1, moves) << distance;
        EXPECT_LE(needed + 1, moves + 2) << distance;
        EXPECT_EQ(after(limit, distance, second), distance) << "must stay";
    }
}

// With A = 1, until the last three ways (1 + 2 + 3 = 6 from the target) every displacement differs
// from the last by 1.
TEST(Limit3, Accelerates_and_brakes_fully_until_it_is_nearly_there) {
    std::mt19937 random(11);
    std::uniform_real_distribution<double> distances(-400.0, 400.0);
    for (int trial = 0; trial < 100; ++trial) {
        const double distance = distances(random);
        Instance limit("limit3");
        limit.set("maxa", 1.0);
        double before = 0.0;
        double moved = 0.0;
        for (int cycle = 0; cycle < 100; ++cycle) {
            const double out = after(limit, distance, second);
            if (std::fabs(distance - out) > 6.0) {
                EXPECT_NEAR(std::fabs(out - before - moved), 1.0, 1e-9)
                    << distance << " cycle " << cycle;
            }
            moved = out - before;
            before = out;
        }
        EXPECT_EQ(before, distance);
    }
}

/// What must hold of every path, whatever the input does.
struct Watch {
    double min, max, step, change;  // step = maxv * period, change = maxa * period^2
    double before = 0.0;
    double last_step = 0.0;
    void see(double out) {
        const double moved = out - before;
        const double rounding = 1e-13 * (1.0 + std::fabs(out));
        EXPECT_GE(out, min - rounding);
        EXPECT_LE(out, max + rounding);
        EXPECT_LE(std::fabs(moved), step + rounding);
        EXPECT_LE(std::fabs(moved - last_step), change * (1.0 + 1e-9) + rounding);
        before = out;
        last_step = moved;
    }
};

TEST(Limit3, Keeps_every_limit_for_every_input) {
    for (unsigned seed = 0; seed < 40; ++seed) {
        std::mt19937 random(seed);
        std::uniform_real_distribution<double> unit(-1.0, 1.0);
        Instance limit("limit3");
        limit.set("smooth-steps", static_cast<int>(seed % 5 * seed % 40));
        limit.set("min", -5.0);
        limit.set("max", 7.0);
        limit.set("maxv", 20.0);
        limit.set("maxa", 300.0);
        Watch watch{-5.0, 7.0, 20.0 * 1e-3, 300.0 * 1e-6};
        double base = 0.0;
        double slope = 0.0;
        double noise = 0.0;
        for (int cycle = 0; cycle < 4000; ++cycle) {
            if (cycle % 97 == 0) {
                base = 9.0 * unit(random);
            }
            if (cycle % 31 == 0) {
                slope = 0.03 * unit(random);
            }
            if (cycle % 211 == 0) {
                noise = std::pow(10.0, 3.0 * unit(random) - 3.0);
            }
            base += slope;
            watch.see(after(limit, base + noise * unit(random)));
            if (testing::Test::HasFailure()) {
                FAIL() << "seed " << seed << " cycle " << cycle;
            }
        }
    }
}

TEST(Limit3, Comes_to_rest_and_stays_at_rest_for_any_scale) {
    for (const double maxa : {1e-3, 1.0, 1e3, 1e7, 1e20}) {
        for (const int smooth : {0, 1, 2, 10, 1000}) {
            for (const double goal : {1e-9, 0.3, 123456.7}) {
                Instance limit("limit3");
                limit.set("smooth-steps", smooth);
                limit.set("maxa", maxa);
                limit.set("in", goal);
                const double slowest = 2.0 * std::sqrt(goal / maxa) / 1e-3 + 2.0 * smooth + 10.0;
                if (slowest > 1e6) continue;
                limit.run(static_cast<int>(slowest));
                for (int i = 0; i < 10; ++i) {
                    EXPECT_EQ(after(limit, goal), goal) << maxa << " " << smooth;
                }
            }
        }
    }
}

TEST(Limit3, Follows_an_input_that_keeps_the_limits_without_lag) {
    for (const double spare : {1.001, 4.0}) {
        Instance limit("limit3");
        limit.set("maxv", 6.29);
        limit.set("maxa", 39.4785 * spare);
        double worst = 0.0;
        // velocity 2 pi, acceleration 4 pi^2 = 39.4784
        for (int cycle = 0; cycle < 5000; ++cycle) {
            limit.set("load", cycle == 0);
            const double in = std::cos(6.2831853 * 1e-3 * cycle);
            worst = std::max(worst, std::fabs(after(limit, in) - in));
        }
        EXPECT_LT(worst, 1e-9) << spare;
    }
}

TEST(Limit3, Catches_up_with_a_ramp_and_meets_its_speed) {
    Instance limit("limit3");
    limit.set("maxv", 3.0);
    limit.set("maxa", 50.0);
    for (int cycle = 0; cycle < 2000; ++cycle) {
        const double in = 1.0 + 2e-3 * cycle;
        const double out = after(limit, in);
        EXPECT_LE(out, in + 1e-12) << "overshoot in cycle " << cycle;
        if (cycle > 1200) {
            EXPECT_NEAR(out, in, 1e-12);
        }
    }
}

TEST(Limit3, Brakes_in_time_for_a_limit_while_following) {
    Instance limit("limit3");
    limit.set("max", 1.0);
    limit.set("maxa", 10.0);
    Watch watch{-1.0, 1.0, 1e9, 10.0 * 1e-6};
    for (int cycle = 0; cycle < 3000; ++cycle) {
        watch.see(after(limit, 1e-3 * cycle));
    }
    EXPECT_EQ(limit.get<double>("out"), 1.0);
}

// Taken for motion, one of these jitters in the middle of the braking would lead about 0.02 beyond
// the target.
TEST(Limit3, Jitter_of_the_target_is_not_taken_for_motion) {
    for (const std::vector<double>& jitter :
         {std::vector{0.0, 1e-4}, {0.0, 1e-7, 1e-4}, {0.0, 0.0, 0.0, 1e-4, 1e-4}}) {
        Instance limit("limit3");
        limit.set("maxa", 100.0);
        double highest = 0.0;
        for (std::size_t cycle = 0; cycle < 2000; ++cycle) {
            highest = std::max(highest, after(limit, 5.0 + jitter[cycle % jitter.size()]));
        }
        EXPECT_LT(highest, 5.0 + 2e-4);
    }
}

TEST(Limit3, A_limit_moved_into_the_way_is_left_and_reached_within_maxa) {
    Instance limit("limit3");
    limit.set("maxa", 10.0);
    Watch watch{-infinity, infinity, infinity, 10.0 * 1e-6};
    for (int cycle = 0; cycle < 300; ++cycle) {
        watch.see(after(limit, 5.0));
    }
    limit.set("max", 0.1);
    for (int cycle = 0; cycle < 3000; ++cycle) {
        watch.see(after(limit, 5.0));
    }
    EXPECT_EQ(limit.get<double>("out"), 0.1);
}

TEST(Limit3, Enable_brings_it_home_within_the_limits) {
    Instance limit("limit3");
    limit.set("maxa", 1.0);
    limit.set("in", 9.0);
    positions(limit, 10);
    limit.set("enable", false);
    expect_near(positions(limit, 6), {8, 6, 3, 1, 0, 0});
}

TEST(Limit3, Load_jumps_within_min_and_max_and_comes_to_rest_there) {
    Instance limit("limit3");
    limit.set("maxa", 1.0);
    limit.set("max", 20.0);
    limit.set("load", true);
    EXPECT_EQ(after(limit, 50.0), 20.0);
    limit.set("load", false);
    for (int i = 0; i < 5; ++i) {
        EXPECT_EQ(after(limit, 50.0), 20.0);
    }
}

TEST(Limit3, Leaves_load_with_the_speed_at_which_it_was_carried) {
    Instance limit("limit3");
    limit.set("maxa", 1.0);
    limit.set("load", true);
    for (int cycle = 0; cycle < 100; ++cycle) {
        after(limit, 0.01 * cycle);
    }
    limit.set("load", false);
    for (int cycle = 100; cycle < 200; ++cycle) {
        EXPECT_NEAR(after(limit, 0.01 * cycle), 0.01 * cycle, 1e-12);
    }
}

TEST(Limit3, A_step_of_the_input_under_load_is_not_taken_for_its_speed) {
    for (const int loaded : {1, 2, 3}) {
        Instance limit("limit3");
        limit.set("maxv", 50.0);
        limit.set("maxa", 400.0);
        limit.set("load", true);
        for (int cycle = 1; cycle < loaded; ++cycle) {
            after(limit, 0.0);
        }
        EXPECT_EQ(after(limit, 10.0), 10.0);
        limit.set("load", false);
        for (int cycle = 0; cycle < 1000; ++cycle) {
            ASSERT_EQ(after(limit, 10.0), 10.0) << loaded << " cycle " << cycle;
        }
    }
}

TEST(Limit3, The_speed_after_load_keeps_maxv_and_stops_before_min_and_max) {
    // the input moves up or down by 50 per second under load and stops with it
    for (const double maxv : {20.0, 50.0, 100.0}) {
        for (const double direction : {-1.0, 1.0}) {
            for (const double limit_at : {0.995, 1.1, 3.0, 100.0}) {
                Instance limit("limit3");
                limit.set("maxv", maxv);
                limit.set("maxa", 400.0);
                limit.set("min", direction < 0.0 ? -limit_at : -200.0);
                limit.set("max", direction > 0.0 ? limit_at : 200.0);
                limit.set("load", true);
                double in = 0.0;
                for (int cycle = 0; cycle < 20; ++cycle) {
                    in += direction * 50e-3;
                    after(limit, in);
                }
                limit.set("load", false);
                double before = limit.get<double>("out");
                for (int cycle = 0; cycle < 2000; ++cycle) {
                    const double out = after(limit, in);
                    ASSERT_LE(direction * out, limit_at + 1e-12) << maxv << " cycle " << cycle;
                    ASSERT_LE(std::fabs(out - before), maxv * 1e-3 + 1e-12) << cycle;
                    before = out;
                }
                EXPECT_EQ(before, std::clamp(in, -limit_at, limit_at));
            }
        }
    }
}

TEST(Limit3, Load_without_acceleration_leaves_without_speed) {
    Instance limit("limit3");
    limit.set("maxa", 0.0);
    limit.set("load", true);
    for (int cycle = 0; cycle < 10; ++cycle) {
        EXPECT_EQ(after(limit, 0.01 * cycle), 0.01 * cycle);
    }
    limit.set("load", false);
    limit.set("maxa", 1.0);
    EXPECT_NEAR(after(limit, 0.09), 0.09, 2e-6);
}

TEST(Limit3, Goes_on_to_the_last_good_target_while_the_input_is_not_a_number) {
    Instance limit("limit3");
    limit.set("maxa", 1.0);
    EXPECT_EQ(after(limit, nan, second), 0.0);
    EXPECT_EQ(after(limit, 9.0, second), 1.0);
    limit.set("in", nan);
    expect_near(positions(limit, 5), {3, 6, 8, 9, 9});
    EXPECT_EQ(after(limit, 10.0, second), 10.0);
}

TEST(Limit3, Stands_still_without_acceleration_and_without_speed) {
    for (const double none : {0.0, -1.0, nan}) {
        Instance no_acceleration("limit3");
        no_acceleration.set("maxa", none);
        EXPECT_EQ(after(no_acceleration, 5.0), 0.0);
        Instance no_speed("limit3");
        no_speed.set("maxv", none);
        EXPECT_EQ(after(no_speed, 5.0), 0.0);
    }
}

TEST(Limit3, Passes_everything_by_default) {
    Instance limit("limit3");
    for (const double in : {5.0, -1e6, 0.0, 1e12}) {
        EXPECT_EQ(after(limit, in), in);
    }
}

}  // namespace
