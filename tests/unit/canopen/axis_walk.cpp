// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include "tests/unit/canopen/axis_stand_in.hpp"

namespace hal::canopen::axis_test {
namespace {

using Words = std::vector<std::uint16_t>;
using States = std::vector<State>;
using enum State;

struct Ride {
    States way;
    Words words;
    bool reached = false;
    Failure failure;
};

/// Walks a drive from one state to another, on limits of 500 ms and 1 s.
Ride walk(StandIn& drive, State wanted, Request request = Request::enable, int cycles = 5000) {
    Walk walk;
    Ride ride;
    drive.tell();
    walk.want(wanted, request);
    AxisOrders orders;
    for (Time now = 0; now < cycles * millisecond; now += millisecond) {
        orders.controlword =
            walk.step(drive.out.statusword, drive.out.error_code, now, {500 * millisecond, second});
        if (ride.words.empty() || ride.words.back() != orders.controlword) {
            ride.words.push_back(orders.controlword);
        }
        ride.reached = walk.reached();
        if (!ride.failure) {
            ride.failure = walk.failure();
        }
        drive.step(orders);
    }
    ride.way = drive.way;
    return ride;
}
Ride walk_from(State from, State wanted) {
    StandIn drive;
    drive.state = from;
    return walk(drive, wanted);
}

TEST(AxisWalk, Goes_from_every_state_to_every_wanted_one) {
    const struct {
        State from, to;
        States way;
        Words words;
    } rows[] = {
        {not_ready_to_switch_on,
         operation_enabled,
         {switch_on_disabled, ready_to_switch_on, switched_on, operation_enabled},
         {0, 6, 7, 15}},
        {switch_on_disabled, ready_to_switch_on, {ready_to_switch_on}, {6}},
        {switch_on_disabled, switched_on, {ready_to_switch_on, switched_on}, {6, 7}},
        {switch_on_disabled,
         operation_enabled,
         {ready_to_switch_on, switched_on, operation_enabled},
         {6, 7, 15}},
        {ready_to_switch_on, switch_on_disabled, {switch_on_disabled}, {0}},
        {ready_to_switch_on, operation_enabled, {switched_on, operation_enabled}, {7, 15}},
        {switched_on, switch_on_disabled, {ready_to_switch_on, switch_on_disabled}, {6, 0}},
        {switched_on, ready_to_switch_on, {ready_to_switch_on}, {6}},
        {switched_on, operation_enabled, {operation_enabled}, {15}},
        {operation_enabled,
         switch_on_disabled,
         {switched_on, ready_to_switch_on, switch_on_disabled},
         {7, 6, 0}},
        {operation_enabled, ready_to_switch_on, {switched_on, ready_to_switch_on}, {7, 6}},
        {operation_enabled, switched_on, {switched_on}, {7}},
        {operation_enabled, quick_stop_active, {quick_stop_active, switch_on_disabled}, {2}},
        {quick_stop_active, switch_on_disabled, {switch_on_disabled}, {2, 0}},
        {quick_stop_active,
         operation_enabled,
         {switch_on_disabled, ready_to_switch_on, switched_on, operation_enabled},
         {15, 6, 7, 15}},
        {switch_on_disabled, quick_stop_active, {}, {2}},
        {fault, switch_on_disabled, {}, {0}},
    };
    for (const auto& row : rows) {
        const Ride ride = walk_from(row.from, row.to);
        const std::string what = std::string(to_string(row.from)) + " to " + to_string(row.to);
        EXPECT_TRUE(ride.reached) << what;
        EXPECT_EQ(row.way, ride.way) << what;
        EXPECT_EQ(row.words, ride.words) << what;
        EXPECT_FALSE(ride.failure) << what << ": " << text(ride.failure);
    }
}

TEST(AxisWalk, Names_every_step_that_is_not_taken) {
    const struct {
        State stuck, wanted;
        Request request;
        const char* text;
    } rows[] = {
        {not_ready_to_switch_on, operation_enabled, Request::enable,
         R"(enable: drive stays in "not ready to switch on" for 0.50 s (statusword 0x0210))"},
        {switch_on_disabled, operation_enabled, Request::enable,
         R"(enable: drive stays in "switch on disabled" after "shutdown" for 0.50 s (statusword 0x0260); voltage-enabled is 0: check the supply of the power stage)"},
        {ready_to_switch_on, operation_enabled, Request::enable,
         R"(enable: drive stays in "ready to switch on" after "switch on" for 0.50 s (statusword 0x0231))"},
        {switched_on, operation_enabled, Request::enable,
         R"(enable: drive stays in "switched on" after "enable operation" for 0.50 s (statusword 0x0233))"},
        {operation_enabled, switch_on_disabled, Request::disable,
         R"(disable: drive stays in "operation enabled" after "disable operation" for 1.00 s (statusword 0x0237))"},
        {operation_enabled, quick_stop_active, Request::quick_stop,
         R"(quick stop: drive stays in "operation enabled" after "quick stop" for 0.50 s (statusword 0x0237))"},
        {ready_to_switch_on, switch_on_disabled, Request::disable,
         R"(disable: drive stays in "ready to switch on" after "disable voltage" for 0.50 s (statusword 0x0231))"},
    };
    for (const auto& row : rows) {
        StandIn drive;
        drive.state = drive.stuck_in = row.stuck;
        EXPECT_EQ(row.text, text(walk(drive, row.wanted, row.request).failure));
    }
}

TEST(AxisWalk, Says_what_the_other_bits_hint_at) {
    StandIn drive;
    drive.state = drive.stuck_in = switched_on;
    drive.cleared = status::remote;
    EXPECT_EQ(
        R"(enable: drive stays in "switched on" after "enable operation" for 0.50 s (statusword 0x0033); remote is 0: the drive is under local control)",
        text(walk(drive, operation_enabled).failure));
    StandIn silent;
    silent.state = silent.stuck_in = not_ready_to_switch_on;
    silent.cleared = 0xffff;
    EXPECT_EQ(
        R"(enable: drive stays in "not ready to switch on" for 0.50 s (statusword 0x0000); check that the statusword is received)",
        text(walk(silent, operation_enabled).failure));
    StandIn odd;
    odd.state = unknown;
    odd.extra = 0x0001;
    odd.cleared = 0x0030;
    EXPECT_EQ(R"(enable: drive shows an undefined state for 0.50 s (statusword 0x0201))",
              text(walk(odd, operation_enabled).failure));
}

TEST(AxisWalk, Disables_the_voltage_when_the_ramp_takes_too_long) {
    StandIn drive;
    drive.state = operation_enabled;
    drive.cleared = 0;
    Walk walk;
    walk.want(switch_on_disabled, Request::disable);
    Words words;
    drive.tell();
    for (Time now = 0; now < 1100 * millisecond; now += millisecond) {  // it brakes for ever
        if (const auto w = walk.step(drive.out.statusword, 0, now, {500 * millisecond, second});
            words.empty() || words.back() != w) {
            words.push_back(w);
        }
    }
    EXPECT_EQ((Words{7, 0}), words);
    EXPECT_EQ(Cause::stays, walk.failure().cause);
    drive.step({.controlword = 0});
    walk.step(drive.out.statusword, 0, 1200 * millisecond, {});
    EXPECT_TRUE(walk.reached());
}

TEST(AxisWalk, Leaves_a_quick_stop_that_the_drive_holds_by_disabling_its_voltage) {
    StandIn drive;
    drive.state = quick_stop_active;
    drive.stays_in_quick_stop = true;
    const Ride off = walk(drive, switch_on_disabled, Request::disable);
    EXPECT_EQ((Words{2, 0}), off.words);
    EXPECT_TRUE(off.reached);
    EXPECT_FALSE(off.failure);
    drive.state = quick_stop_active;
    const Ride on = walk(drive, operation_enabled);
    EXPECT_EQ((Words{15, 0, 6, 7, 15}), on.words);
    EXPECT_TRUE(on.reached);
}

TEST(AxisWalk, Stops_at_a_fault_and_says_which_step_led_there) {
    StandIn drive;
    drive.state = switched_on;
    drive.tell();
    Walk walk;
    walk.want(operation_enabled, Request::enable);
    EXPECT_EQ(15, walk.step(drive.out.statusword, 0, 0, {}));
    drive.fail(error::position_sensor);
    drive.tell();
    EXPECT_EQ(0, walk.step(drive.out.statusword, drive.out.error_code, millisecond, {}));
    EXPECT_EQ(
        R"(enable: drive went into fault after "enable operation" (statusword 0x0238, error 0x7305: incremental sensor 1))",
        text(walk.failure()));
    walk.want(switch_on_disabled, Request::disable);
    walk.step(drive.out.statusword, drive.out.error_code, 2 * millisecond, {});
    EXPECT_TRUE(walk.reached());
}

TEST(AxisWalk, Resets_a_fault_by_an_edge) {
    StandIn drive;
    drive.fail(error::over_voltage);
    drive.tell();
    Walk walk;
    Words words;
    walk.reset_fault();
    Time now = 0;
    const auto run = [&](int cycles) {
        for (int i = 0; i < cycles; ++i) {
            const auto w = walk.step(drive.out.statusword, drive.out.error_code, now += millisecond,
                                     {500 * millisecond, second});
            if (words.empty() || words.back() != w) {
                words.push_back(w);
            }
            drive.step({.controlword = w});
        }
    };
    run(10);
    EXPECT_EQ((Words{0, 0x80, 0}), words);
    EXPECT_EQ(switch_on_disabled, walk.state());
    EXPECT_FALSE(walk.failure());
    drive.fail(0xffff);  // the cause is still there
    drive.tell();
    walk.reset_fault();
    run(600);
    EXPECT_EQ(
        R"(reset: drive stays in "fault" after "fault reset" for 0.50 s (statusword 0x0238, error 0xFFFF: device specific))",
        text(walk.failure()));
    EXPECT_FALSE(walk.resetting());
}

}  // namespace
}  // namespace hal::canopen::axis_test
