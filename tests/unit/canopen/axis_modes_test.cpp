// SPDX-License-Identifier: MIT
// The axis of a master in its modes: targets, set-points, homing, velocity, and the sentences of
// its failures.
#include <gtest/gtest.h>

#include "tests/unit/canopen/axis_stand_in.hpp"

namespace hal::canopen::axis_test {
namespace {

TEST(Axis, Mode_is_followed_when_the_drive_shows_it) {
    Pair p;
    p.rules.max_step = 1;
    ASSERT_TRUE(p.enable());
    p.command.mode = Mode::cyclic_velocity;
    p.command.velocity = 500;
    p.cycle();
    EXPECT_FALSE(p.axis.active());
    EXPECT_EQ(0, p.last.target_velocity);
    p.cycle(2);
    EXPECT_TRUE(p.axis.active());
    EXPECT_EQ(500, p.last.target_velocity);
    p.drive.answers_mode = false;
    p.command.mode = Mode::cyclic_torque;
    p.command.torque = 100;
    p.cycle(400);
    EXPECT_TRUE(p.axis.enabled());
    EXPECT_EQ(0, p.last.target_torque);
    p.cycle(110);
    EXPECT_EQ("mode: drive does not accept mode cst, displays csv for 0.50 s (statusword 0x0237)",
              p.why());
}

TEST(Axis, Each_mode_has_its_target_and_its_bits) {
    const auto at = [](Mode mode) {
        Pair p;
        p.command.mode = mode;
        p.command.velocity = 30;
        p.command.torque = 50;
        EXPECT_TRUE(p.enable()) << p.why();
        p.cycle(1000);
        p.command.halt = true;
        const auto orders = p.last;
        p.cycle(2);
        EXPECT_EQ(mode < Mode::cyclic_position ? 0x10f : 0x00f, p.last.controlword & 0x10f);
        return orders;
    };
    auto o = at(Mode::velocity);
    EXPECT_EQ(30, o.vl_target_velocity);
    EXPECT_EQ(0x7f, o.controlword);
    o = at(Mode::profile_velocity);
    EXPECT_EQ(30, o.target_velocity);
    EXPECT_EQ(0x0f, o.controlword);
    EXPECT_EQ(50, at(Mode::profile_torque).target_torque);
    EXPECT_EQ(0x1f, at(Mode::interpolated_position).controlword);
    o = at(Mode::cyclic_position);
    EXPECT_EQ(30, o.velocity_offset);
    EXPECT_EQ(50, o.torque_offset);
    o = at(Mode::cyclic_velocity);
    EXPECT_EQ(30, o.target_velocity);
    EXPECT_EQ(50, o.torque_offset);
    EXPECT_EQ(50, at(Mode::cyclic_torque).target_torque);
}

TEST(Axis, Set_points_shake_hands) {
    Pair p;
    p.command.mode = Mode::profile_position;
    p.command.go = true;
    p.cycle();
    EXPECT_EQ("go: the axis is not enabled", p.why());
    p.command.go = false;
    p.command.reset = true;
    p.cycle();
    ASSERT_TRUE(p.enable()) << p.why();
    p.cycle(2);
    p.words.clear();
    p.command.position = 77;
    p.command.go = true;
    p.cycle(3);
    EXPECT_EQ(77, p.last.target_position);
    EXPECT_FALSE(p.axis.target_reached());
    p.command.go = false;
    p.cycle();
    p.command.position = -5;
    p.command.relative = p.command.immediate = p.command.go = true;
    p.cycle(10);
    EXPECT_EQ(-5, p.last.target_position);
    EXPECT_EQ((std::vector<std::uint16_t>{0x0f, 0x1f, 0x0f, 0x6f, 0x7f, 0x0f}), p.words);
    EXPECT_FALSE(p.axis.target_reached());
    p.drive.extra = status::target_reached;
    p.cycle(3);
    EXPECT_TRUE(p.axis.target_reached());
    p.drive.acknowledges = false;
    p.command.go = false;
    p.cycle();
    p.command.go = true;
    p.cycle(600);
    EXPECT_EQ("go: drive does not acknowledge the set-point for 0.50 s (statusword 0x0637)",
              p.why());
}

TEST(Axis, Set_points_wait_while_the_drive_has_no_room) {
    SetPoints s;
    std::int32_t target = 0;
    Time now = 0;
    const std::uint16_t busy = 0x0237;
    const std::uint16_t full = busy | status::set_point_acknowledge;
    for (int i = 0; i < 16; ++i) {
        EXPECT_TRUE(s.push({.target = i}));
    }
    EXPECT_FALSE(s.push({.target = 16}));
    for (int i = 0; i < 10; ++i) {
        EXPECT_EQ(0, s.step(full, now += second, second, target))
            << "the set-point buffer of the drive is full: no failure";
    }
    EXPECT_FALSE(s.failure());
    EXPECT_EQ(0, s.step(busy, now += millisecond, second, target));
    EXPECT_EQ(control::new_set_point, s.step(busy, now += millisecond, second, target));
    EXPECT_EQ(15u, s.waiting());
    EXPECT_EQ(0, s.step(full, now += millisecond, second, target));
    EXPECT_TRUE(s.push({.target = 99, .immediate = true}));
    EXPECT_EQ(1u, s.waiting());
    for (int i = 0; i < 8; ++i) {
        s.step(full | status::target_reached, now += second, 2 * second, target);
    }
    EXPECT_EQ("go: drive does not clear its acknowledge for 2.00 s (statusword 0x1637)",
              text(s.failure()));
}

TEST(Axis, An_immediate_relative_set_point_adds_those_that_it_replaces) {
    const auto passed = [](std::initializer_list<SetPoint> points) {
        SetPoints s;
        for (const SetPoint& p : points) {
            EXPECT_TRUE(s.push(p));
        }
        EXPECT_EQ(1u, s.waiting());
        std::int32_t target = 0;
        const std::uint16_t bits = s.step(0x0237, millisecond, second, target);
        return std::pair(target, (bits & control::relative) != 0);
    };
    const SetPoint by_1{.target = 1, .relative = true, .immediate = true};
    const SetPoint by_5{.target = 5, .relative = true};
    const SetPoint to_100{.target = 100};
    EXPECT_EQ(std::pair(3, true), passed({by_1, by_1, by_1}));
    EXPECT_EQ(std::pair(6, true), passed({by_5, by_1}));
    EXPECT_EQ(std::pair(106, false), passed({by_5, to_100, by_5, by_1}));
    EXPECT_EQ(std::pair(7, false), passed({by_5, {.target = 7, .immediate = true}}));
    SetPoints far;
    EXPECT_TRUE(far.push({.target = INT32_MAX, .relative = true}));
    EXPECT_FALSE(far.push(by_1));
    EXPECT_EQ(1u, far.waiting());
}

struct HomingPair : Pair {
    HomingPair() {
        drive.follows = false;
        drive.out.position = 5000;
        EXPECT_TRUE(enable()) << why();
        command.home = true;
        EXPECT_TRUE(until([&] { return (last.controlword & control::start_homing) != 0; }));
        EXPECT_EQ(Mode::homing, last.mode);
        EXPECT_TRUE(axis.homing());
        EXPECT_FALSE(axis.active());
    }
};

TEST(Axis, Homing_attained_makes_the_position_that_of_the_drive) {
    HomingPair p;
    p.cycle(50);
    p.drive.out.position = 12;
    p.drive.extra = status::homing_attained | status::target_reached;
    ASSERT_TRUE(p.until([&] { return p.axis.homed(); }));
    EXPECT_DOUBLE_EQ(12.0, p.axis.position());
    EXPECT_EQ(0x0f, p.last.controlword);
    p.command.position = 12;
    ASSERT_TRUE(p.until([&] { return p.axis.active(); }));
    EXPECT_FALSE(p.axis.homing());
    EXPECT_EQ(Mode::cyclic_position, p.last.mode);
    EXPECT_EQ(12, p.last.target_position);
}

TEST(Axis, Homing_does_not_take_an_old_result_for_its_own) {
    Pair p;
    p.drive.follows = false;
    p.drive.extra = status::homing_attained | status::target_reached;
    ASSERT_TRUE(p.enable());
    p.command.home = true;
    p.cycle(200);
    EXPECT_TRUE(p.axis.homing());
    EXPECT_FALSE(p.axis.homed());
    p.drive.extra = 0;
    p.cycle(5);
    EXPECT_FALSE(p.axis.homed());
    p.drive.extra = status::homing_attained | status::target_reached;
    p.cycle(5);
    EXPECT_TRUE(p.axis.homed());
    p.command.home = false;
    p.cycle(20);
    p.command.home = true;
    p.cycle(520);  // method 37: done within the cycle, the result never left
    EXPECT_TRUE(p.axis.homed());
}

TEST(Axis, Homing_fails_in_words) {
    HomingPair p;
    p.cycle(5);
    p.drive.extra = status::homing_error;
    p.cycle(2);
    EXPECT_EQ(R"(home: drive reports "error, still moving" (statusword 0x2237))", p.why());
    HomingPair q;
    q.rules.homing = 3 * second;
    q.cycle(2000);
    q.command.halt = true;
    q.cycle(2000);
    q.command.halt = false;
    EXPECT_FALSE(q.axis.failure()) << "a halt stops the clock";
    q.cycle(1100);
    EXPECT_EQ("home: home position not attained within 3.00 s (statusword 0x0237)", q.why());
    HomingPair r;
    r.command.home = false;
    r.cycle(20);
    EXPECT_FALSE(r.axis.homing());
    EXPECT_FALSE(r.axis.homed());
    EXPECT_FALSE(r.axis.failure());
    EXPECT_TRUE(r.axis.active());
    Pair s;
    s.command.home = true;
    s.cycle();
    EXPECT_EQ("home: the axis is not enabled", s.why());
}

TEST(Axis, Velocity_comes_from_the_position_when_the_drive_does_not_send_it) {
    Pair p;
    p.rules.position = {1000, 1};
    p.drive.out.has_velocity = false;
    p.cycle();
    p.drive.out.position += 5;
    p.cycle();
    EXPECT_DOUBLE_EQ(5.0, p.axis.velocity());
    p.drive.out.has_velocity = true;
    p.drive.out.velocity = 70;
    p.rules.velocity = {10, 1};
    p.cycle();
    EXPECT_DOUBLE_EQ(7.0, p.axis.velocity());
    p.drive.out.operational = false;
    p.cycle();
    EXPECT_DOUBLE_EQ(0.0, p.axis.velocity());
    EXPECT_DOUBLE_EQ(0.005, p.axis.position());
}

TEST(AxisFailure, Every_sentence_of_the_cycle_is_there_beforehand) {
    const Sentences sentences;
    Pair p;
    p.drive.stuck_in = State::switched_on;
    p.enable();
    EXPECT_STREQ(
        R"(enable: drive stays in "switched on" after "enable operation" for {} s; axis off)",
        sentences.find(p.axis.failure()));
    EXPECT_DOUBLE_EQ(0.5, Sentences::number(p.axis.failure()));
    Failure odd;
    odd.cause = Cause::mode_rejected;
    odd.request = Request::mode;
    odd.mode = Mode::cyclic_position;

    odd.shown = static_cast<Mode>(-3);
    EXPECT_STREQ("mode: drive does not accept mode csp, displays another for {} s; axis off",
                 sentences.find(odd));
    EXPECT_EQ("mode: drive does not accept mode csp, displays -3", sentence(odd));
    odd.shown = Mode::none;
    EXPECT_STREQ("mode: drive does not accept mode csp, displays none for {} s; axis off",
                 sentences.find(odd));
    odd.mode = static_cast<Mode>(99);
    EXPECT_STREQ("mode: drive does not accept this number, displays none for {} s; axis off",
                 sentences.find(odd));
    for (unsigned cause = 1; cause < causes; ++cause) {
        Failure f;
        f.cause = static_cast<Cause>(cause);
        f.request = f.cause == Cause::left || f.cause == Cause::step_rejected ? Request::run
                    : f.cause == Cause::mode_rejected                         ? Request::mode
                    : f.cause == Cause::homing_error                          ? Request::home
                    : f.cause == Cause::set_point                             ? Request::go
                                                                              : Request::enable;
        f.before = State::operation_enabled;
        f.mode = Mode::cyclic_position;

        f.statusword = status::homing_error;
        EXPECT_STRNE("the axis failed", sentences.find(f)) << cause;
    }
}

}  // namespace
}  // namespace hal::canopen::axis_test
