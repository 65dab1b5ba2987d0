// SPDX-License-Identifier: MIT
// Ramps with limited jerk: 6086h = 3 and 60A4h.
#include "cia402/drive/trajectory.hpp"
#include "drive_bench.hpp"

namespace hal::canopen::test {
namespace {

constexpr double dt = 0.001;
constexpr double velocity = 20000;
constexpr double acceleration = 100000;
constexpr double jerk = 1e6;

constexpr double corner = acceleration / jerk;

struct Course {
    std::vector<Motion> points;
    double seconds() const { return static_cast<double>(points.size()) * dt; }
};

/// A profile from 0 to `target`, its corners off; `steps` cuts a millisecond into that many.
Course course(double target, double time, unsigned steps = 1) {
    Course result;
    Profile profile;
    Smoother smoother;
    smoother.begin({}, time);
    profile.plan({}, target, {velocity, acceleration, acceleration, 0});
    for (int n = 0; n < 20000; ++n) {
        Motion m;
        for (unsigned k = 0; k < steps; ++k) {
            profile.step(smoother.raw(), dt / steps);
            m = smoother.step(dt / steps);
        }
        result.points.push_back(m);
        if (profile.done() && smoother.settled()) break;
    }
    return result;
}

TEST(Smoother_, keeps_velocity_acceleration_and_jerk) {
    const auto c = course(30000, corner);
    double fastest = 0;
    double steepest = 0;
    double sharpest = 0;
    for (std::size_t n = 1; n < c.points.size(); ++n) {
        fastest = std::max(fastest, std::abs(c.points[n].velocity));
        steepest =
            std::max(steepest, std::abs(c.points[n].velocity - c.points[n - 1].velocity) / dt);
        sharpest = std::max(sharpest,
                            std::abs(c.points[n].acceleration - c.points[n - 1].acceleration) / dt);
    }
    EXPECT_NEAR(fastest, velocity, 1);
    EXPECT_LE(steepest, acceleration * 1.0001);
    EXPECT_GT(steepest, acceleration * 0.98);
    EXPECT_LE(sharpest, jerk * 1.0001);
    EXPECT_GT(sharpest, jerk * 0.98);
}

TEST(Smoother_, ends_exactly_where_the_motion_ends_and_later_by_its_time) {
    for (const double target : {30000.0, -30000.0, 17.0, 0.25}) {
        const auto plain = course(target, 0);
        const auto round = course(target, corner);
        EXPECT_EQ(round.points.back().position, target);
        EXPECT_EQ(round.points.back().velocity, 0);
        EXPECT_NEAR(round.seconds() - plain.seconds(), corner, 2.5 * dt) << target;
    }
}

TEST(Smoother_, position_and_velocity_belong_together) {
    const auto c = course(30000, corner);
    double position = 0;
    double before = 0;
    for (const auto& m : c.points) {
        position += (before + m.velocity) / 2 * dt;
        before = m.velocity;
        EXPECT_NEAR(m.position, position, 2);
    }
}

TEST(Smoother_, gives_the_same_however_fine_the_steps_are) {
    const auto coarse = course(30000, corner);
    const auto fine = course(30000, corner, 8);
    for (std::size_t n = 0; n < std::min(coarse.points.size(), fine.points.size()); ++n) {
        EXPECT_NEAR(coarse.points[n].position, fine.points[n].position, 15) << n;
    }
    EXPECT_EQ(fine.points.back().position, 30000);
}

TEST(Smoother_, without_time_gives_the_motion_itself) {
    Smoother smoother;
    smoother.begin({5, 3, 0}, 0);
    EXPECT_EQ(smoother.raw().position, 5);
    smoother.raw() = {7, 4, 1};
    EXPECT_EQ(smoother.step(dt).position, 7);
    EXPECT_TRUE(smoother.settled());
}

TEST(Smoother_, goes_on_without_a_jump_from_a_motion_under_way) {
    Smoother smoother;
    smoother.begin({100, 50, 0}, corner);
    EXPECT_NEAR(smoother.raw().position, 100 + 50 * corner / 2, 1e-9);
    for (int n = 1; n < 300; ++n) {
        smoother.raw().position += 50 * dt;
        const auto m = smoother.step(dt);
        EXPECT_NEAR(m.position, 100 + 50 * n * dt, 1e-6);
        EXPECT_NEAR(m.velocity, 50, 1e-6);
    }
}

struct DriveJerk : DriveBench {
    /// Milliseconds until bit 10 after a set-point, and the greatest change of 606Bh per ms.
    int go(std::int32_t target) {
        set(object::target_position, target);
        control(command::enable_operation | control::new_set_point);
        steepest = 0;
        int ms = 0;
        for (std::int32_t before = 0; ms < 5000; ++ms) {
            run(1);
            if (ms == 0) {
                control(command::enable_operation);

                before = get<std::int32_t>(object::velocity_demand);
            }
            const auto v = get<std::int32_t>(object::velocity_demand);
            changes.push_back(v - before);
            before = v;
            steepest = std::max(steepest, std::abs(changes.back()));
            if (bit(status::target_reached)) break;
        }
        return ms;
    }
    void prepare(std::uint32_t limit) {
        make();
        set(object::profile_velocity, 20000);
        set(object::profile_acceleration, 100000);

        set(object::profile_deceleration, 100000);
        set(object::profile_jerk, limit, 0, 1);
        set(object::motion_profile_type, limit != 0 ? jerk_limited : linear_ramps);
        enable(Mode::profile_position);
    }
    int steepest = 0;
    std::vector<std::int32_t> changes;
};

TEST_F(DriveJerk, Profile_position_is_smoother_and_ends_at_the_same_place_so_much_later) {
    prepare(0);
    const int plain = go(20000);
    EXPECT_NEAR(position(), 20000, 10);
    prepare(1'000'000);
    changes.clear();
    const int round = go(20000);
    EXPECT_NEAR(position(), 20000, 10);
    EXPECT_NEAR(round - plain, 100, 15);
    EXPECT_LE(steepest, 102) << "100 000 per s² are 100 per ms";
    int sharpest = 0;
    for (std::size_t n = 1; n < changes.size(); ++n) {
        sharpest = std::max(sharpest, std::abs(changes[n] - changes[n - 1]));
    }
    EXPECT_LE(sharpest, 3) << "a jerk of 1 000 000 per s³ is 1 per ms², the demand is rounded";
}

TEST_F(DriveJerk, Set_point_that_is_changed_on_the_way_keeps_the_jerk) {
    prepare(1'000'000);
    set(object::target_position, 40000);
    control(command::enable_operation | control::new_set_point | control::change_immediately);
    control(command::enable_operation | control::change_immediately);
    std::vector<std::int32_t> all;
    for (int n = 0; n < 2500; ++n) {
        if (n == 250) {
            set(object::target_position, -5000);
            control(command::enable_operation | control::new_set_point |
                    control::change_immediately);
        } else {
            run(1);
        }
        all.push_back(get<std::int32_t>(object::velocity_demand));
    }
    EXPECT_NEAR(position(), -5000, 10);
    EXPECT_TRUE(bit(status::target_reached));
    for (std::size_t n = 2; n < all.size(); ++n) {
        EXPECT_LE(std::abs(all[n] - 2 * all[n - 1] + all[n - 2]), 4) << n;
    }
}

TEST_F(DriveJerk, Profile_velocity_keeps_the_jerk) {
    prepare(1'000'000);
    set_mode(Mode::profile_velocity);
    set(object::target_velocity, 10000);
    std::vector<std::int32_t> all;
    for (int n = 0; n < 400; ++n) {
        run(1);
        all.push_back(get<std::int32_t>(object::velocity_demand));
    }
    EXPECT_NEAR(all.back(), 10000, 2);
    EXPECT_NEAR(velocity(), 10000, 200);
    for (std::size_t n = 2; n < all.size(); ++n) {
        EXPECT_LE(std::abs(all[n] - 2 * all[n - 1] + all[n - 2]), 3) << n;
    }
}

TEST_F(DriveJerk, Halt_and_quick_stop_are_ramps_as_before) {
    prepare(1'000'000);
    set(object::target_position, 100000);
    control(command::enable_operation | control::new_set_point);
    run(400);
    control(command::enable_operation | control::halt);
    run(250);
    EXPECT_EQ(get<std::int32_t>(object::velocity_demand), 0);
    control(command::enable_operation);
    EXPECT_TRUE(until([&] { return bit(status::target_reached); }, 10000));
    EXPECT_NEAR(position(), 100000, 10);
}

TEST_F(DriveJerk, Types_of_ramps_it_does_not_know_are_refused) {
    make();
    for (const int type : {1, 2, 4, -1}) {
        EXPECT_EQ(write(object::motion_profile_type, 0, type), Abort::value) << type;
    }
    for (const int use : {0, 2, 4}) {
        EXPECT_EQ(write(object::profile_jerk_use, 0, use), Abort::value) << use;
    }
    EXPECT_EQ(write(object::profile_jerk_use, 0, 1), Abort::none);
}

TEST_F(DriveJerk, Homing_method_36_and_those_of_makers_are_refused) {
    make();
    for (const int method : {36, 15, 16, 31, 32, 38, -1, -128}) {
        EXPECT_EQ(write(object::homing_method, 0, method), Abort::value) << method;
    }
}

}  // namespace
}  // namespace hal::canopen::test
