// SPDX-License-Identifier: MIT
// The axis of a master: its units, enabling, what it rejects, faults, the loss of its node.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/unit/canopen/axis_stand_in.hpp"

namespace hal::canopen::axis_test {
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
    std::int32_t before = p.last.target_position;
    std::int32_t farthest = 0;
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
    for (int i = 0; i < 10; ++i) {
        p.command.position += 10;
        p.cycle(2);
    }
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
    EXPECT_EQ("enable: position-cmd is farther from position-fb than max-step (3, limit 0.5)",
              p.why());
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
    s.drive.out.position = 1000;
    s.command.position = 1000;
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
    EXPECT_EQ(
        R"(enable: drive stays in "switched on" after "enable operation" for 0.50 s (statusword 0x0233))",
        p.why());
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
    EXPECT_EQ(
        R"(run: drive left "operation enabled" for "switched on" without a command (statusword 0x0233))",
        p.why());
    Pair q;
    ASSERT_TRUE(q.enable());
    q.drive.state = State::fault_reaction_active;
    q.drive.tell();
    q.cycle();
    q.drive.fail(error::following_error);
    q.drive.tell();
    q.cycle(2);
    EXPECT_EQ("run: drive went into fault (statusword 0x023F, error 0x8611: following error)",
              q.why());
    q.cycle(100);
    EXPECT_EQ(State::fault, q.drive.state);
    q.command.enable = false;
    q.command.reset = true;
    ASSERT_TRUE(q.until([&] { return !q.axis.fault(); }));
    EXPECT_EQ(State::switch_on_disabled, q.drive.state);
    q.drive.fail(error::over_voltage);  // off, and all the same
    q.drive.tell();
    q.cycle();
    EXPECT_EQ("enable: drive is in fault (statusword 0x0238, error 0x3210: DC link over-voltage)",
              q.why());
    q.rules.auto_reset = true;
    EXPECT_TRUE(q.enable()) << q.why();
}

TEST(Axis, Off_and_on_again_while_the_drive_is_slow_to_obey_is_no_failure) {
    // cycles; statusword and controlword are each delayed by five
    for (const unsigned off : {1U, 2U, 3U, 5U, 8U, 13U, 21U}) {
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
        // the order from before is not taken for the cause twice
        p.drive.state = State::switched_on;
        p.drive.tell();
        p.cycle(10);
        EXPECT_EQ(
            R"(run: drive left "operation enabled" for "switched on" without a command (statusword 0x0233))",
            p.why())
            << off;
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
    EXPECT_EQ("run: drive went into fault (statusword 0x0238, error 0x3210: DC link over-voltage)",
              q.why());
}

TEST(Axis, Reset_that_does_not_help_is_a_failure) {
    Pair p;
    p.drive.fail(0xffff);
    p.cycle(2);
    p.command.reset = true;
    p.cycle(600);
    EXPECT_EQ(
        R"(reset: drive stays in "fault" after "fault reset" for 0.50 s (statusword 0x0238, error 0xFFFF: device specific))",
        p.why());
}

TEST(Axis, Node_lost_is_a_failure_and_takes_another_edge) {
    Pair p;
    p.drive.out.operational = false;
    p.command.enable = true;
    p.cycle(5000);
    EXPECT_FALSE(p.axis.fault()) << "it was never there: enable waits";
    EXPECT_EQ(command::quick_stop, p.last.controlword);
    p.drive.out.operational = true;
    ASSERT_TRUE(p.until([&] { return p.axis.enabled(); }));
    p.drive.out.operational = false;
    p.cycle();
    EXPECT_EQ("run: drive lost: node no longer operational", p.why());
    EXPECT_EQ(command::quick_stop, p.last.controlword);
    p.drive.out.operational = true;
    p.cycle(100);
    EXPECT_FALSE(p.axis.enabled());
    p.command.enable = false;
    p.command.reset = true;
    p.cycle();
    EXPECT_TRUE(p.enable()) << p.why();
}

TEST(Axis, Stop_disables_without_a_failure_and_takes_another_edge) {
    Pair p;
    ASSERT_TRUE(p.enable()) << p.why();
    p.axis.interrupt();
    EXPECT_FALSE(p.axis.enabled());
    p.cycle(10);
    EXPECT_FALSE(p.axis.enabled());
    EXPECT_FALSE(p.axis.failure()) << p.why();
    EXPECT_EQ(State::switch_on_disabled, p.drive.state);
    p.command.enable = false;
    p.cycle();
    EXPECT_TRUE(p.enable()) << p.why();
}

/// An axis that brakes when its thread stops, and is enabled meanwhile: `operational` and the
/// statusword are those of before the stop until the bus has run.
struct StoppedWhileBraking : testing::Test {
    Pair p;

    void SetUp() override {
        ASSERT_TRUE(p.enable()) << p.why();
        p.drive.stuck_in = State::operation_enabled;  // a long ramp
        p.command.enable = false;
        p.cycle(10);
        p.axis.interrupt();
        p.now += 60 * second;
        p.command.enable = true;
    }
    void lose(unsigned cycles) {
        p.drive.out.operational = false;
        p.cycle(cycles);
    }
    void find_switched_off() {
        p.drive.stuck_in = State::unknown;
        p.drive.state = State::switch_on_disabled;
        p.drive.tell();
        p.drive.out.operational = true;
    }
};

TEST_F(StoppedWhileBraking, Waits_for_the_bus_after_cycles_with_the_old_statusword) {
    p.cycle(3);
    lose(200);
    EXPECT_FALSE(p.axis.failure()) << p.why();
    find_switched_off();
    EXPECT_TRUE(p.until([&] { return p.axis.active() || p.axis.failure(); }));
    EXPECT_FALSE(p.axis.failure()) << p.why();
}

TEST_F(StoppedWhileBraking, Enables_a_drive_that_has_stopped_meanwhile) {
    p.cycle(3);
    find_switched_off();
    EXPECT_TRUE(p.until([&] { return p.drive.state == State::operation_enabled; }));
    p.cycle(2);
    EXPECT_FALSE(p.axis.failure()) << p.why();
    EXPECT_TRUE(p.axis.active());
}

TEST_F(StoppedWhileBraking, A_loss_after_a_second_is_a_failure) {
    p.cycle(1001);
    lose(1);
    EXPECT_EQ(Cause::lost, p.axis.failure().cause);
}

TEST_F(StoppedWhileBraking, A_second_loss_is_a_failure) {
    p.cycle(3);
    lose(3);
    p.drive.out.operational = true;
    p.cycle(3);
    lose(1);
    EXPECT_EQ(Cause::lost, p.axis.failure().cause);
}

TEST_F(StoppedWhileBraking, A_loss_once_the_drive_was_enabled_is_a_failure) {
    p.cycle(3);
    find_switched_off();
    ASSERT_TRUE(p.until([&] { return p.drive.state == State::operation_enabled; }));
    p.cycle(2);
    ASSERT_TRUE(p.axis.enabled());
    lose(1);
    EXPECT_EQ(Cause::lost, p.axis.failure().cause);
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

}  // namespace
}  // namespace hal::canopen::axis_test
