// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/unit/canopen/axis_stand_in.hpp"

namespace hal::canopen::cia402::test {
namespace {

TEST(AxisUnits, Counter_goes_on_where_the_drives_wraps) {
    Counter c;
    c.follow(0x7ffffff0, 32);
    c.follow(-0x7ffffff0, 32);
    EXPECT_EQ(0x80000010LL, c.count());
    c.follow(0x7ffffff0, 32);
    EXPECT_EQ(0x7ffffff0LL, c.count());
    Counter narrow;  // 16 bits, sent in 32
    narrow.follow(0xfff0, 16);
    narrow.follow(0x0010, 16);
    EXPECT_EQ(0x10010, narrow.count());
    EXPECT_EQ(-32768, Counter::low_bits(0x8000, 16));
    EXPECT_EQ(std::numeric_limits<std::int32_t>::min(), Counter::low_bits(0x80000000U, 32));
}

TEST(AxisUnits, Factor_rounds_and_keeps_within_the_type) {
    const Factor gear{7, 3};
    EXPECT_EQ(2, gear.to_drive<std::int32_t>(1.0));
    EXPECT_DOUBLE_EQ(3.0, gear.to_user(7));
    EXPECT_EQ(32767, Factor{}.to_drive<std::int16_t>(1e9));
    EXPECT_EQ(-32768, Factor{}.to_drive<std::int16_t>(-1e9));
    EXPECT_EQ(0, Factor{}.to_drive<std::int32_t>(std::nan("")));
    EXPECT_EQ(14u, (Factor{-7, 1}).amount(2.0));
    EXPECT_FALSE((Factor{0, 1}).sound());
    EXPECT_FALSE((Factor{1, 0}).sound());
}

TEST(Axis, Enables_without_a_jump_and_joins_the_command_softly) {
    Pair p;
    p.rules.position = {1000, 1};
    p.drive.out.position = 250'000;
    p.command.position = 260.0;
    p.cycle(5);
    EXPECT_EQ(250'000, p.last.target_position);
    EXPECT_FALSE(p.axis.active());
    ASSERT_TRUE(p.enable()) << p.why();
    EXPECT_EQ(250'000, p.last.target_position);
    std::int32_t before = p.last.target_position, farthest = 0;
    while (p.last.target_position < 260'000) {
        p.cycle();
        farthest = std::max(farthest, p.last.target_position - before);
        before = p.last.target_position;
    }
    EXPECT_LE(farthest, 31);  // 10 000 counts in 0.5 s, 1.5 times that speed at most
    p.cycle(10);
    p.command.position = 260.001;
    p.cycle();
    EXPECT_EQ(260'001, p.last.target_position);
    EXPECT_DOUBLE_EQ(260.001, p.axis.commanded());
}

TEST(Axis, Position_is_endless_and_targets_wrap_as_the_drives_counter) {
    Pair p;
    p.rules.max_step = 100;
    p.drive.out.position = std::numeric_limits<std::int32_t>::max() - 5;
    p.command.position = p.drive.out.position;
    ASSERT_TRUE(p.enable());
    for (int i = 0; i < 10; ++i) p.command.position += 10, p.cycle(2);
    EXPECT_EQ(std::numeric_limits<std::int32_t>::min() + 94, p.last.target_position);
    EXPECT_DOUBLE_EQ(2147483742.0, p.axis.position());
    EXPECT_FALSE(p.axis.failure()) << p.why();
    p.command.enable = false;
    p.cycle(10);
    ASSERT_EQ(State::switch_on_disabled, p.axis.state());
    ASSERT_TRUE(p.enable());  // continuous over it
    EXPECT_DOUBLE_EQ(2147483742.0, p.axis.position());
    EXPECT_EQ(std::numeric_limits<std::int32_t>::min() + 94, p.last.target_position);
}

TEST(Axis, Refuses_a_command_elsewhere_at_enabling_and_one_that_steps) {
    Pair p;
    p.rules.max_step = 0.5;
    p.command.position = 3;
    EXPECT_FALSE(p.enable());
    EXPECT_EQ("enable: position-cmd is farther from position-fb than max-step (3, limit 0.5)", p.why());
    EXPECT_EQ(0, p.last.target_position);
    p.command = {.reset = true, .mode = Mode::cyclic_position};
    p.cycle(20);
    ASSERT_TRUE(p.enable()) << p.why();
    p.command.position = 0.5;
    p.cycle();
    EXPECT_TRUE(p.axis.active());
    p.command.position = 1.1;
    p.cycle();
    EXPECT_EQ("run: position-cmd steps farther than max-step (0.6, limit 0.5)", p.why());
    EXPECT_FALSE(p.axis.enabled());
    p.cycle(10);
    EXPECT_EQ(State::switch_on_disabled, p.drive.state);
    EXPECT_EQ((std::vector<State>{State::quick_stop_active, State::switch_on_disabled}),
              (std::vector<State>{p.drive.way.end() - 2, p.drive.way.end()}));
}

TEST(Axis, Watches_the_following_error) {
    Pair p;
    p.rules.max_following_error = 5;
    p.drive.follows = false;
    ASSERT_TRUE(p.enable());
    p.command.position = 4;
    p.cycle(2000);
    EXPECT_DOUBLE_EQ(4.0, p.axis.following_error());
    p.command.position = 5.5;
    p.cycle();
    EXPECT_EQ("run: following error above max-following-error (5.5, limit 5)", p.why());
    p.cycle(5);
    EXPECT_EQ(State::switch_on_disabled, p.drive.state);
}

TEST(Axis, Refuses_what_is_no_number) {
    Pair p;
    ASSERT_TRUE(p.enable());
    p.command.position = std::nan("");
    p.cycle();
    EXPECT_EQ("run: the command is not a number, or too large (nan)", p.why());
    Pair q;
    q.command.mode = Mode::cyclic_velocity;
    ASSERT_TRUE(q.enable());
    q.command.velocity = std::numeric_limits<double>::infinity();
    q.cycle();
    EXPECT_EQ("run: the command is not a number, or too large (inf)", q.why());
    EXPECT_EQ(0, q.last.target_velocity);
    Pair r;
    r.rules.position = {0, 1};
    EXPECT_FALSE(r.enable());
    EXPECT_EQ("enable: a scale is 0 or not a number (0)", r.why());
    Pair s;
    s.drive.out.position = 1000, s.command.position = 1000;
    ASSERT_TRUE(s.enable()) << s.why();
    s.cycle(5);
    s.rules.position = {0, 1};
    s.cycle();
    EXPECT_EQ("run: a scale is 0 or not a number (0)", s.why());
    EXPECT_EQ(1000, s.last.target_position);
}

TEST(Axis, Names_the_failing_step_and_switches_off) {
    Pair p;
    p.drive.stuck_in = State::switched_on;
    EXPECT_FALSE(p.enable());
    EXPECT_EQ(R"(enable: drive stays in "switched on" after "enable operation" for 0.50 s (statusword 0x0233))", p.why());
    p.drive.stuck_in = State::unknown;
    p.cycle(10);
    EXPECT_EQ(State::switch_on_disabled, p.drive.state);
    EXPECT_TRUE(p.axis.fault());
    p.cycle(1000);
    EXPECT_EQ(State::switch_on_disabled, p.drive.state) << "enable takes another edge";
    p.command.enable = false;
    p.cycle();
    p.command.reset = true;
    p.cycle();
    EXPECT_FALSE(p.axis.fault());
    EXPECT_TRUE(p.enable());
}

TEST(Axis, Sees_that_the_drive_left_by_itself_or_failed) {
    Pair p;
    ASSERT_TRUE(p.enable());
    p.drive.state = State::switched_on;
    p.drive.tell();
    p.cycle();
    EXPECT_EQ(R"(run: drive left "operation enabled" for "switched on" without a command (statusword 0x0233))", p.why());
    Pair q;
    ASSERT_TRUE(q.enable());
    q.drive.state = State::fault_reaction_active;
    q.drive.tell();
    q.cycle();
    q.drive.fail(error::following_error);
    q.drive.tell();
    q.cycle(2);
    EXPECT_EQ("run: drive went into fault (statusword 0x023F, error 0x8611: following error)", q.why());
    q.cycle(100);
    EXPECT_EQ(State::fault, q.drive.state);
    q.command.enable = false;
    q.command.reset = true;
    ASSERT_TRUE(q.until([&] { return !q.axis.fault(); }));
    EXPECT_EQ(State::switch_on_disabled, q.drive.state);
    q.drive.fail(error::over_voltage);  // off, and all the same
    q.drive.tell();
    q.cycle();
    EXPECT_EQ("enable: drive is in fault (statusword 0x0238, error 0x3210: DC link over-voltage)", q.why());
    q.rules.auto_reset = true;
    EXPECT_TRUE(q.enable()) << q.why();
}

TEST(Axis, Off_and_on_again_while_the_drive_is_slow_to_obey_is_no_failure) {
    for (const unsigned off : {1U, 2U, 3U, 5U, 8U, 13U, 21U}) {  // cycles; statusword and controlword are each delayed by five
        Pair p;
        p.delay = 5;
        ASSERT_TRUE(p.enable()) << p.why();
        p.cycle(20);
        p.command.enable = false;
        p.cycle(off);
        p.command.enable = true;
        p.cycle(100);
        EXPECT_TRUE(p.axis.enabled()) << off << ": " << p.why();
        EXPECT_EQ(State::operation_enabled, p.drive.state) << off;
        p.drive.state = State::switched_on, p.drive.tell();  // the order from before is not taken for the cause twice
        p.cycle(10);
        EXPECT_EQ(R"(run: drive left "operation enabled" for "switched on" without a command (statusword 0x0233))", p.why()) << off;
    }
    Pair q;  // nor for that of a fault
    q.delay = 5;
    ASSERT_TRUE(q.enable());
    q.command.enable = false;
    q.cycle();
    q.command.enable = true;
    q.cycle(2);
    q.drive.fail(error::over_voltage);
    q.cycle(10);
    EXPECT_EQ("run: drive went into fault (statusword 0x0238, error 0x3210: DC link over-voltage)", q.why());
}

TEST(Axis, Reset_that_does_not_help_is_a_failure) {
    Pair p;
    p.drive.fail(0xffff);
    p.cycle(2);
    p.command.reset = true;
    p.cycle(600);
    EXPECT_EQ(R"(reset: drive stays in "fault" after "fault reset" for 0.50 s (statusword 0x0238, error 0xFFFF: device specific))",
              p.why());
}

TEST(Axis, Node_lost_is_a_failure_and_takes_another_edge) {
    Pair p;
    p.drive.out.operational = false;
    p.command.enable = true;
    p.cycle(5000);
    EXPECT_FALSE(p.axis.fault()) << "it was never there: enable waits";
    EXPECT_EQ(0, p.last.controlword);
    p.drive.out.operational = true;
    ASSERT_TRUE(p.until([&] { return p.axis.enabled(); }));
    p.drive.out.operational = false;
    p.cycle();
    EXPECT_EQ("run: drive lost: node no longer operational", p.why());
    EXPECT_EQ(0, p.last.controlword);
    p.drive.out.operational = true;
    p.cycle(100);
    EXPECT_FALSE(p.axis.enabled());
    p.command.enable = false, p.command.reset = true;
    p.cycle();
    EXPECT_TRUE(p.enable()) << p.why();
}

TEST(Axis, Quick_stop_takes_another_edge) {
    Pair p;
    ASSERT_TRUE(p.enable());
    p.command.quick_stop = true;
    p.cycle();
    EXPECT_EQ(2, p.last.controlword);
    p.cycle(10);
    EXPECT_EQ(State::switch_on_disabled, p.drive.state);
    EXPECT_FALSE(p.axis.fault());
    p.command.quick_stop = false;
    p.cycle(100);
    EXPECT_EQ(State::switch_on_disabled, p.drive.state);
    p.command.enable = false;
    p.cycle();
    EXPECT_TRUE(p.enable());
}

TEST(Axis, Mode_is_followed_when_the_drive_shows_it) {
    Pair p;
    p.rules.max_step = 1;
    ASSERT_TRUE(p.enable());
    p.command.mode = Mode::cyclic_velocity, p.command.velocity = 500;
    p.cycle();
    EXPECT_FALSE(p.axis.active());
    EXPECT_EQ(0, p.last.target_velocity);
    p.cycle(2);
    EXPECT_TRUE(p.axis.active());
    EXPECT_EQ(500, p.last.target_velocity);
    p.drive.answers_mode = false;
    p.command.mode = Mode::cyclic_torque, p.command.torque = 100;
    p.cycle(400);
    EXPECT_TRUE(p.axis.enabled());
    EXPECT_EQ(0, p.last.target_torque);
    p.cycle(110);
    EXPECT_EQ("mode: drive does not accept mode cst, displays csv for 0.50 s (statusword 0x0237)", p.why());
}

TEST(Axis, Each_mode_has_its_target_and_its_bits) {
    const auto at = [](Mode mode) {
        Pair p;
        p.command.mode = mode, p.command.velocity = 30, p.command.torque = 50;
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
    p.command.go = false, p.command.reset = true;
    p.cycle();
    ASSERT_TRUE(p.enable()) << p.why();
    p.cycle(2);
    p.words.clear();
    p.command.position = 77, p.command.go = true;
    p.cycle(3);
    EXPECT_EQ(77, p.last.target_position);
    EXPECT_FALSE(p.axis.target_reached());
    p.command.go = false, p.cycle();
    p.command.position = -5, p.command.relative = p.command.immediate = p.command.go = true;
    p.cycle(10);
    EXPECT_EQ(-5, p.last.target_position);
    EXPECT_EQ((std::vector<std::uint16_t>{0x0f, 0x1f, 0x0f, 0x6f, 0x7f, 0x0f}), p.words);
    EXPECT_FALSE(p.axis.target_reached());
    p.drive.extra = status::target_reached;
    p.cycle(3);
    EXPECT_TRUE(p.axis.target_reached());
    p.drive.acknowledges = false;
    p.command.go = false, p.cycle(), p.command.go = true;
    p.cycle(600);
    EXPECT_EQ("go: drive does not acknowledge the set-point for 0.50 s (statusword 0x0637)", p.why());
}

TEST(Axis, Set_points_wait_while_the_drive_has_no_room) {
    SetPoints s;
    std::int32_t target = 0;
    Time now = 0;
    const std::uint16_t busy = 0x0237, full = busy | status::set_point_acknowledge;
    for (int i = 0; i < 16; ++i) EXPECT_TRUE(s.push({.target = i}));
    EXPECT_FALSE(s.push({.target = 16}));
    for (int i = 0; i < 10; ++i) EXPECT_EQ(0, s.step(full, now += second, second, target)) << "the set-point buffer of the drive is full: no failure";
    EXPECT_FALSE(s.failure());
    EXPECT_EQ(0, s.step(busy, now += millisecond, second, target));
    EXPECT_EQ(control::new_set_point, s.step(busy, now += millisecond, second, target));
    EXPECT_EQ(15u, s.waiting());
    EXPECT_EQ(0, s.step(full, now += millisecond, second, target));
    EXPECT_TRUE(s.push({.target = 99, .immediate = true}));
    EXPECT_EQ(1u, s.waiting());
    for (int i = 0; i < 8; ++i) s.step(full | status::target_reached, now += second, 2 * second, target);
    EXPECT_EQ("go: drive does not clear its acknowledge for 2.00 s (statusword 0x1637)", text(s.failure()));
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
    p.command.home = false, p.cycle(20), p.command.home = true;
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
    p.drive.out.has_velocity = true, p.drive.out.velocity = 70;
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
    EXPECT_STREQ(R"(enable: drive stays in "switched on" after "enable operation" for {} s; axis off)", sentences.find(p.axis.failure()));
    EXPECT_DOUBLE_EQ(0.5, Sentences::number(p.axis.failure()));
    Failure odd;
    odd.cause = Cause::mode_rejected, odd.request = Request::mode, odd.mode = Mode::cyclic_position, odd.shown = static_cast<Mode>(-3);
    EXPECT_STREQ("mode: drive does not accept mode csp, displays another for {} s; axis off", sentences.find(odd));
    EXPECT_EQ("mode: drive does not accept mode csp, displays -3", sentence(odd));
    odd.shown = Mode::none;
    EXPECT_STREQ("mode: drive does not accept mode csp, displays none for {} s; axis off", sentences.find(odd));
    for (unsigned cause = 1; cause < causes; ++cause) {
        Failure f;
        f.cause = static_cast<Cause>(cause);
        f.request = f.cause == Cause::left || f.cause == Cause::step_rejected ? Request::run
                    : f.cause == Cause::mode_rejected                          ? Request::mode
                    : f.cause == Cause::homing_error                          ? Request::home
                    : f.cause == Cause::set_point                             ? Request::go
                                                                              : Request::enable;
        f.before = State::operation_enabled, f.mode = Mode::cyclic_position, f.statusword = status::homing_error;
        EXPECT_STRNE("the axis failed", sentences.find(f)) << cause;
    }
}

}  // namespace
}  // namespace hal::canopen::cia402::test
