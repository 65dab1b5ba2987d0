// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

#include "unit/components/component_host.hpp"

namespace {

using hal::test::Instance;

constexpr std::int64_t base_ns = 50'000;
constexpr std::int64_t servo_ns = 1'000'000;

struct Stepgen : Instance {
    explicit Stepgen(const char* type, const char* control = "p", const char* user = "")
        : Instance("stepgen",
                   {{"step_type", type}, {"ctrl_type", control}, {"user_step_type", user}}) {
        set("enable", true);
        run("make-pulses", base_ns);
    }
    /// `cycles` servo cycles of 20 fast ones; `each` is called after each fast one.
    template <class Each>
    void servo(int cycles, Each each) {
        for (int i = 0; i < cycles; ++i) {
            run("capture-position", servo_ns);
            run("update-freq", servo_ns);
            for (int k = 0; k < 20; ++k) {
                run("make-pulses", base_ns);
                each();
            }
        }
        run("capture-position", servo_ns);
    }
    void servo(int cycles) {
        servo(cycles, [] {});
    }
};

TEST(Stepgen, Velocity_mode_makes_that_many_steps) {
    Stepgen s("0", "v");
    EXPECT_FALSE(s.has_pin("position-cmd"));
    s.set("position-scale", 100.0);
    s.set("velocity-cmd", 12.34);
    int rises = 0;
    bool before = false;
    s.servo(1000, [&] {
        rises += s.get<bool>("step") && !before ? 1 : 0;
        before = s.get<bool>("step");
    });
    EXPECT_EQ(s.get<std::int32_t>("counts"), 1234);
    EXPECT_EQ(rises, 1234);
    EXPECT_NEAR(s.get<double>("position-fb"), 12.34, 1e-9);
    EXPECT_DOUBLE_EQ(s.get<double>("frequency"), 1234.0);
    EXPECT_FALSE(s.get<bool>("dir"));
    s.set("velocity-cmd", -12.34);
    s.servo(1000);
    EXPECT_NEAR(s.get<std::int32_t>("counts"), 0, 1);
    EXPECT_TRUE(s.get<bool>("dir"));
}

TEST(Stepgen, Speed_is_limited_by_the_pulse_times_and_by_maxvel) {
    Stepgen s("0", "v");
    s.set("velocity-cmd", 1e9);
    s.set("steplen", 120'000);   // 3 periods
    s.set("stepspace", 60'000);  // 2 periods
    s.servo(1);
    EXPECT_DOUBLE_EQ(s.get<double>("frequency"), 20'000.0 / 5);
    s.set("maxvel", 250.0);
    s.servo(1);
    EXPECT_DOUBLE_EQ(s.get<double>("frequency"), 250.0);
    s.set("maxaccel", 1000.0);
    s.set("velocity-cmd", 0.0);
    s.servo(10);
    EXPECT_NEAR(s.get<double>("frequency"), 240.0, 1e-9);
}

TEST(Stepgen, Keeps_every_time_of_step_and_direction) {
    Stepgen s("0", "v");
    s.set("steplen", 100'000);   // 2 periods
    s.set("stepspace", 150'000); // 3
    s.set("dirhold", 200'000);   // 4
    s.set("dirsetup", 250'000);  // 5
    int high = 0;
    int low = 1000;
    int dir_age = 1000;
    int shortest_high = 1000;
    int max_high = 0;

    int shortest_low = 1000;
    int shortest_hold = 1000;
    int shortest_setup = 1000;
    bool step = false;
    bool dir = false;
    int reversals = 0;
    for (int round = 0; round < 40; ++round) {
        s.set("velocity-cmd", (round % 2 != 0 ? -1.0 : 1.0) * (500.0 + 90.0 * round));
        s.servo(7, [&] {
            const bool now = s.get<bool>("step");
            const bool now_dir = s.get<bool>("dir");
            if (now_dir != dir) {
                EXPECT_FALSE(now && step);
                shortest_hold = std::min(shortest_hold, low);
                dir_age = 0;
                ++reversals;
            }
            if (now && !step) {
                shortest_low = std::min(shortest_low, low);
                shortest_setup = std::min(shortest_setup, dir_age);
                high = 0;
            }
            if (!now && step) {
                shortest_high = std::min(shortest_high, high);
                max_high = std::max(max_high, high);
                low = 0;
            }
            ++(now ? high : low);
            ++dir_age;
            step = now;
            dir = now_dir;
        });
    }
    EXPECT_GT(reversals, 20);
    EXPECT_EQ(shortest_high, 2);
    EXPECT_EQ(max_high, 2);
    EXPECT_EQ(shortest_low, 3);
    EXPECT_EQ(shortest_hold, 4);
    EXPECT_EQ(shortest_setup, 5);
}

TEST(Stepgen, Steps_that_had_to_wait_are_made_later) {
    Stepgen s("0", "v");
    s.set("dirsetup", 2'000'000);
    s.set("velocity-cmd", -1000.0);
    s.servo(5);
    s.set("velocity-cmd", 0.0);
    s.servo(20);
    EXPECT_EQ(s.get<std::int32_t>("counts"), -5);
}

TEST(Stepgen, Follows_a_position_within_its_limits_and_does_not_overshoot) {
    Stepgen s("0");
    s.set("position-scale", 200.0);
    s.set("maxvel", 5.0);
    s.set("maxaccel", 20.0);
    s.set("position-cmd", 3.0);
    double speed = 0.0;
    double last = 0.0;
    double highest = 0.0;
    double fastest = 0.0;
    for (int i = 0; i < 2000; ++i) {
        s.servo(1);
        const double at = s.get<double>("position-fb");
        const double now = (at - last) / 1e-3;
        EXPECT_LE(std::abs(now - speed), 20.0 * 1e-3 * 1.0001 + 1e-9);
        fastest = std::max(fastest, now);
        highest = std::max(highest, at);
        speed = now;
        last = at;
        if (i == 900) {  // 0.25 s up, 0.35 s at speed, 0.25 s down
            EXPECT_NEAR(at, 3.0, 1e-3);
        }
    }
    EXPECT_LE(highest, 3.0 + 1e-9);
    EXPECT_NEAR(fastest, 5.0, 1e-6);
    EXPECT_EQ(s.get<std::int32_t>("counts"), 600);
}

TEST(Stepgen, Follows_a_moving_position_one_cycle_behind) {
    Stepgen s("0");
    s.set("position-scale", 1000.0);
    s.set("maxaccel", 100.0);
    for (int i = 1; i <= 2000; ++i) {
        s.set("position-cmd", 2.0 * i * 1e-3);
        s.servo(1);
    }
    // where the command will be at the next cycle
    EXPECT_NEAR(s.get<double>("position-fb"), 4.0 + 2e-3, 1e-4);
}

TEST(Stepgen, Disabled_makes_no_steps_and_catches_up_later) {
    Stepgen s("0");
    s.set("enable", false);
    s.set("position-cmd", 50.0);
    s.servo(100);
    EXPECT_EQ(s.get<std::int32_t>("counts"), 0);
    EXPECT_EQ(s.get<double>("frequency"), 0.0);
    s.set("enable", true);
    s.servo(100);
    EXPECT_EQ(s.get<std::int32_t>("counts"), 50);
}

TEST(Stepgen, Up_and_down_pulse_on_their_own_pins) {
    Stepgen s("1", "v");
    int ups = 0;
    int downs = 0;
    bool up = false;
    bool down = false;
    const auto look = [&] {
        ups += s.get<bool>("up") && !up ? 1 : 0;
        downs += s.get<bool>("down") && !down ? 1 : 0;
        up = s.get<bool>("up");
        down = s.get<bool>("down");
        EXPECT_FALSE(up && down);
    };
    s.set("velocity-cmd", 2000.0);
    s.servo(100, look);
    s.set("velocity-cmd", -500.0);
    s.servo(100, look);
    EXPECT_NEAR(ups, 200, 1);
    EXPECT_NEAR(downs, 50, 1);
}

/// The states a stepgen goes through, seen from its phase pins, over `steps` steps at a step per
/// four periods.
std::vector<unsigned> states(Stepgen& s, int phases, int steps) {
    static constexpr std::array names{"phase-A", "phase-B", "phase-C", "phase-D", "phase-E"};
    std::vector<unsigned> seen;
    s.set("velocity-cmd", 5000.0);
    s.servo(steps, [&] {
        unsigned state = 0;
        for (int i = 0; i < phases; ++i) {
            state |= s.get<bool>(names[static_cast<std::size_t>(i)]) ? 1u << i : 0u;
        }
        if (seen.empty() || seen.back() != state) {
            seen.push_back(state);
        }
    });
    seen.resize(static_cast<std::size_t>(steps));
    return seen;
}

TEST(Stepgen, Unipolar_phases_are_switched_in_the_documented_way) {
    struct Case {
        const char* type;
        int phases, length, fewest_on, max_on;
    };
    for (const Case c : {Case{"2", 2, 4, 0, 2}, Case{"3", 3, 3, 1, 1}, Case{"4", 3, 6, 1, 2},
                         Case{"5", 4, 4, 1, 1}, Case{"6", 4, 4, 2, 2}, Case{"9", 4, 8, 1, 2},
                         Case{"11", 5, 5, 1, 1}, Case{"12", 5, 5, 2, 2}, Case{"13", 5, 10, 1, 2},
                         Case{"14", 5, 10, 2, 3}}) {
        Stepgen s(c.type, "v");
        const std::vector<unsigned> seen = states(s, c.phases, 24);
        // half steps and quadrature: one phase changes; else one comes, one goes
        const bool alternates = c.fewest_on != c.max_on;
        for (std::size_t k = 0; k < seen.size(); ++k) {
            EXPECT_GE(std::popcount(seen[k]), c.fewest_on) << c.type;
            EXPECT_LE(std::popcount(seen[k]), c.max_on) << c.type;
            if (k > 0) {
                EXPECT_EQ(std::popcount(seen[k] ^ seen[k - 1]), alternates ? 1 : 2) << c.type;
            }
            const auto cycle = static_cast<std::size_t>(c.length);
            for (std::size_t j = k + 1; j < seen.size(); ++j) {
                EXPECT_EQ(seen[j] == seen[k], (j - k) % cycle == 0) << c.type;
            }
        }
    }
}

TEST(Stepgen, Bipolar_phases_turn_the_current_evenly) {
    struct Case {
        const char* type;
        int step_degrees;
    };
    for (const Case c : {Case{"7", 90}, Case{"8", 90}, Case{"10", 45}}) {
        Stepgen s(c.type, "v");
        int last = -1;
        for (const unsigned state : states(s, 4, 24)) {
            const auto on = [state](int phase) { return static_cast<int>(state >> phase & 1u); };
            // current in bridge A-B and in bridge C-D
            const double x = on(0) - on(1);
            const double y = on(2) - on(3);
            ASSERT_TRUE(x != 0.0 || y != 0.0) << c.type;
            const int angle =
                static_cast<int>(std::lround(std::atan2(y, x) * 180.0 / std::numbers::pi) + 360) %
                360;
            if (last >= 0) {
                EXPECT_EQ(angle, (last + c.step_degrees) % 360) << c.type;
            }
            last = angle;
        }
    }
}

TEST(Stepgen, User_states_are_taken_in_order) {
    Stepgen s("15", "v", "0x1,0x7,2");
    EXPECT_TRUE(s.has_pin("phase-C"));
    EXPECT_FALSE(s.has_pin("phase-D"));
    const auto seen = states(s, 3, 6);
    EXPECT_EQ(seen, (std::vector<unsigned>{1, 7, 2, 1, 7, 2}));
    EXPECT_THROW(Stepgen("15", "v", ""), std::runtime_error);
    EXPECT_THROW(Stepgen("15", "v", "1,32"), std::runtime_error);
    EXPECT_THROW(Stepgen("15", "v", "1,x"), std::runtime_error);
    EXPECT_THROW(Stepgen("0", "q"), std::runtime_error);
}

}  // namespace
