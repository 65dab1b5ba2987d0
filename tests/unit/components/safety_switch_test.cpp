// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <string>

#include "unit/components/component_host.hpp"

namespace {

using hal::test::Instance;

enum : std::uint32_t {
    is_safe,
    open,
    closing,
    opening,
    waits,
    button_down,
    no_close = 10,
    no_open,
    test_a_failed,
    test_b_failed,
    short_between,
    stuck,
    bad
};

struct Switch : Instance {
    explicit Switch(int reset_mode = 1) : Instance("safety_switch") {
        set("reset-mode", reset_mode);
        set("debounce-time", 0.0);
    }
    void contacts(bool a, bool b, int cycles = 1) {
        set("in-a", a);
        set("in-b", b);
        run(cycles);
    }
    void press(int cycles) {
        set("reset", true);
        run(cycles);
        set("reset", false);
        run(1);
    }
    std::uint32_t reason() const { return get<std::uint32_t>("reason"); }
    void make_safe() {
        contacts(true, true);
        press(100);
        ASSERT_EQ(reason(), is_safe);
        ASSERT_TRUE(get<bool>("safe"));
    }
};

TEST(SafetySwitch, Equivalent_truth_table) {
    struct Case {
        bool a, b;
        std::uint32_t from_open, from_safe;
    };
    for (const Case c : {Case{false, false, open, open}, Case{true, false, closing, opening},
                         Case{false, true, closing, opening}, Case{true, true, waits, is_safe}}) {
        Switch fresh, closed;
        fresh.contacts(c.a, c.b);
        EXPECT_EQ(fresh.reason(), c.from_open);
        EXPECT_FALSE(fresh.get<bool>("safe"));
        closed.make_safe();
        closed.contacts(c.a, c.b);
        EXPECT_EQ(closed.reason(), c.from_safe);
        EXPECT_EQ(closed.get<bool>("safe"), c.a && c.b);
        EXPECT_FALSE(closed.get<bool>("fault"));
    }
}

TEST(SafetySwitch, Antivalent_truth_table) {
    struct Case {
        bool a, b;
        std::uint32_t reason;
    };
    for (const Case c : {Case{false, true, open}, Case{true, true, closing},
                         Case{false, false, closing}, Case{true, false, waits}}) {
        Switch s;
        s.set("antivalent", true);
        s.contacts(false, true);
        s.contacts(c.a, c.b);
        EXPECT_EQ(s.reason(), c.reason) << c.a << c.b;
        EXPECT_EQ(s.get<bool>("ready-to-reset"), c.reason == waits);
    }
}

TEST(SafetySwitch, Opening_acts_in_the_same_cycle_and_closing_after_the_debounce_time) {
    Switch s(0);
    s.set("debounce-time", 0.005);
    s.contacts(true, true, 5);
    EXPECT_FALSE(s.get<bool>("safe"));
    s.contacts(false, false);  // a bounce: the time begins anew
    s.contacts(true, true, 5);
    EXPECT_FALSE(s.get<bool>("safe"));
    s.run(1);
    EXPECT_TRUE(s.get<bool>("safe"));
    s.contacts(true, false);
    EXPECT_FALSE(s.get<bool>("safe"));
}

TEST(SafetySwitch, Filter_time_lets_short_openings_pass) {
    Switch s(0);
    s.set("filter-time", 0.003);
    s.contacts(true, true);
    s.contacts(false, true, 3);
    EXPECT_TRUE(s.get<bool>("safe"));
    s.contacts(true, true);
    s.contacts(false, true, 4);
    EXPECT_FALSE(s.get<bool>("safe"));
}

TEST(SafetySwitch, Discrepancy_beyond_its_time_is_a_fault_either_way) {
    for (const bool from_safe : {false, true}) {
        Switch s;
        s.set("discrepancy-time", 0.020);
        if (from_safe) {
            s.make_safe();
        }
        s.contacts(true, false, 21);
        EXPECT_FALSE(s.get<bool>("fault"));
        s.run(1);
        EXPECT_TRUE(s.get<bool>("fault"));
        EXPECT_EQ(s.reason(), from_safe ? no_open : no_close);
        s.contacts(true, true, 10);
        s.press(100);
        EXPECT_TRUE(s.get<bool>("fault"));  // both have to open first
        EXPECT_FALSE(s.get<bool>("ready-to-reset"));
        s.contacts(false, false);
        EXPECT_TRUE(s.get<bool>("ready-to-reset"));
        s.press(100);
        EXPECT_EQ(s.reason(), open);
        s.contacts(true, true);
        EXPECT_EQ(s.reason(), waits);
    }
}

TEST(SafetySwitch, Discrepancy_within_its_time_is_not_a_fault) {
    Switch s(0);
    s.set("discrepancy-time", 0.020);
    s.contacts(true, false, 20);
    s.contacts(true, true);
    EXPECT_TRUE(s.get<bool>("safe"));
}

TEST(SafetySwitch, One_contact_that_opens_and_closes_again_stays_unsafe) {
    Switch s(0);
    s.set("discrepancy-time", 0.020);
    s.contacts(true, true);
    s.contacts(false, true);
    s.contacts(true, true, 5);
    EXPECT_FALSE(s.get<bool>("safe"));
    EXPECT_EQ(s.reason(), opening);
    s.run(20);
    EXPECT_EQ(s.reason(), no_open);
}

TEST(SafetySwitch, Manual_reset_acts_on_pressing_after_closing) {
    Switch s(1);
    s.set("reset", true);
    s.contacts(true, true, 3);
    EXPECT_EQ(s.reason(), button_down);  // pressed before
    EXPECT_FALSE(s.get<bool>("ready-to-reset"));
    s.set("reset", false);
    s.run(1);
    EXPECT_EQ(s.reason(), waits);
    s.set("reset", true);
    s.run(1);
    EXPECT_TRUE(s.get<bool>("safe"));
}

TEST(SafetySwitch, Monitored_reset_acts_on_releasing_a_press_of_valid_duration) {
    struct Case {
        int cycles;
        bool taken;
    };
    for (const Case c :
         {Case{49, false}, Case{50, true}, Case{500, true}, Case{1001, true}, Case{1002, false}}) {
        Switch s(2);
        s.set("reset-min-time", 0.050);
        s.set("reset-max-time", 1.000);
        s.contacts(true, true);
        s.set("reset", true);
        s.run(c.cycles);
        EXPECT_FALSE(s.get<bool>("safe"));
        EXPECT_EQ(s.reason() == stuck, c.cycles > 1001) << c.cycles;
        EXPECT_EQ(s.get<bool>("fault"), c.cycles > 1001);
        s.set("reset", false);
        s.run(1);
        EXPECT_EQ(s.get<bool>("safe"), c.taken) << c.cycles;
        if (!c.taken) {
            EXPECT_EQ(s.reason(), waits);
        }
    }
}

TEST(SafetySwitch, Monitored_press_that_began_too_early_or_saw_an_opening_does_not_count) {
    Switch early(2);
    early.set("reset", true);
    early.run(10);
    early.contacts(true, true, 100);
    early.set("reset", false);
    early.run(1);
    EXPECT_EQ(early.reason(), waits);

    Switch interrupted(2);
    interrupted.contacts(true, true);
    interrupted.set("reset", true);
    interrupted.run(60);
    interrupted.contacts(false, false);
    interrupted.contacts(true, true, 60);
    interrupted.set("reset", false);
    interrupted.run(1);
    EXPECT_EQ(interrupted.reason(), waits);
}

TEST(SafetySwitch, A_safe_value_written_by_the_host_needs_a_reset) {
    Switch s;
    s.make_safe();
    s.set("safe", false);  // as `stop` does
    s.run(5);
    EXPECT_EQ(s.reason(), waits);
    EXPECT_FALSE(s.get<bool>("safe"));
}

TEST(SafetySwitch, Invalid_parameters_are_a_fault) {
    Switch s;
    s.make_safe();
    s.set("discrepancy-time", -1.0);
    s.run(1);
    EXPECT_EQ(s.reason(), bad);
    EXPECT_FALSE(s.get<bool>("safe"));
    s.set("discrepancy-time", std::nan(""));
    s.run(1);
    EXPECT_EQ(s.reason(), bad);
    s.set("discrepancy-time", 0.5);
    s.set("test-period", 0.010);  // two pulses of 3 ms and their responses do not fit
    s.run(1);
    EXPECT_EQ(s.reason(), bad);
    s.set("test-period", 0.0);
    s.set("reset-mode", 3);
    s.run(1);
    EXPECT_EQ(s.reason(), bad);
    s.set("reset-mode", 1);
    s.contacts(false, false);
    s.press(1);
    EXPECT_EQ(s.reason(), open);
}

/// A switch fed by its own test outputs through wires with a fault, a cycle of delay each way.
struct Wired : Switch {
    bool a_closed = true;
    bool b_closed = true;
    bool a_to_supply = false;
    bool b_to_supply = false;
    bool shorted_or = false;
    bool shorted_and = false;

    Wired() : Switch(0) {
        set("test-period", 0.100);
        set("test-width", 0.004);
        set("test-response", 0.002);
        cycle(10);
    }
    void cycle(int cycles) {
        for (int i = 0; i < cycles; ++i) {
            bool a = a_closed && get<bool>("test-a");
            bool b = b_closed && get<bool>("test-b");
            if (shorted_or) {
                a = b = a || b;
            }
            if (shorted_and) {
                a = b = a && b;
            }
            set("in-a", a || a_to_supply);
            set("in-b", b || b_to_supply);
            run(1);
            pulses_a += get<bool>("test-a") ? 0 : 1;
            pulses_b += get<bool>("test-b") ? 0 : 1;
            EXPECT_TRUE(get<bool>("test-a") || get<bool>("test-b"));
        }
    }
    int pulses_a = 0;
    int pulses_b = 0;
};

TEST(SafetySwitch, Test_pulses_do_not_disturb_a_good_switch) {
    Wired s;
    ASSERT_TRUE(s.get<bool>("safe"));
    for (int i = 0; i < 1000; ++i) {
        s.cycle(1);
        ASSERT_TRUE(s.get<bool>("safe")) << i;
    }
    EXPECT_EQ(s.pulses_a, 40);  // ten periods, 4 ms each
    EXPECT_EQ(s.pulses_b, 40);
}

TEST(SafetySwitch, Test_pulses_find_shorts_to_the_supply) {
    for (const bool at_a : {true, false}) {
        Wired s;
        (at_a ? s.a_to_supply : s.b_to_supply) = true;
        s.cycle(110);
        EXPECT_FALSE(s.get<bool>("safe"));
        EXPECT_EQ(s.reason(), at_a ? test_a_failed : test_b_failed);
        s.a_closed = s.b_closed = false;
        s.cycle(10);
        s.press(5);
        EXPECT_TRUE(s.get<bool>("fault"));  // the shorted input still looks closed
        s.a_to_supply = s.b_to_supply = false;
        s.cycle(10);
        EXPECT_TRUE(s.get<bool>("ready-to-reset"));
        s.press(5);
        s.a_closed = s.b_closed = true;
        s.cycle(10);
        EXPECT_TRUE(s.get<bool>("safe"));
    }
}

TEST(SafetySwitch, Test_pulses_find_shorts_between_the_contacts) {
    Wired one_high_wins;
    one_high_wins.shorted_or = true;
    one_high_wins.cycle(60);
    EXPECT_FALSE(one_high_wins.get<bool>("safe"));
    EXPECT_TRUE(one_high_wins.reason() == test_a_failed || one_high_wins.reason() == test_b_failed);

    Wired one_low_wins;
    one_low_wins.shorted_and = true;
    one_low_wins.cycle(60);
    EXPECT_FALSE(one_low_wins.get<bool>("safe"));
    EXPECT_EQ(one_low_wins.reason(), short_between);
}

TEST(SafetySwitch, Opening_during_a_test_pulse_is_seen_right_after_it) {
    Wired s;
    while (s.get<bool>("test-a")) {
        s.cycle(1);
    }
    s.a_closed = false;
    int cycles = 0;
    while (s.get<bool>("safe") && cycles < 100) {
        s.cycle(1);
        ++cycles;
    }
    EXPECT_LE(cycles, 7);  // width, response and the cycle of the wires
    s.b_closed = false;
    s.cycle(1);
    s.cycle(200);
    EXPECT_EQ(s.reason(), open);
}

}  // namespace
