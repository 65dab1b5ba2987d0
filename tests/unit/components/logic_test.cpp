// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include "unit/components/component_host.hpp"

namespace {

using hal::test::Instance;

/// Feeds `in` a pattern of 0 and 1, a cycle each, and gives what `out` was after each cycle.
std::string response(Instance& instance, const std::string& pattern, const std::string& in = "in",
                     const std::string& out = "out") {
    std::string answer;
    for (const char c : pattern) {
        instance.set(in, c == '1');
        instance.run();
        answer += instance.get<bool>(out) ? '1' : '0';
    }
    return answer;
}

/// Outputs of a gate for the inputs (in1 in0) 00, 01, 10, 11.
std::string truth_table(const std::string& component) {
    Instance gate(component);
    std::string table;
    for (int inputs = 0; inputs < 4; ++inputs) {
        gate.set("in0", (inputs & 1) != 0);
        gate.set("in1", (inputs & 2) != 0);
        gate.run();
        table += gate.get<bool>("out") ? '1' : '0';
    }
    return table;
}

TEST(Gates, Follow_their_truth_tables) {
    EXPECT_EQ(truth_table("and2"), "0001");
    EXPECT_EQ(truth_table("or2"), "0111");
    EXPECT_EQ(truth_table("xor2"), "0110");
}

TEST(Not, Inverts) {
    Instance inverter("not");
    EXPECT_EQ(response(inverter, "0110"), "1001");
}

TEST(Gates, Work_through_signals) {
    Instance first("and2"), second("not");
    first.link("out", second, "in");
    first.set("in0", true);
    first.set("in1", true);
    first.run();
    second.run();
    EXPECT_FALSE(second.get<bool>("out"));
    first.set("in1", false);
    first.run();
    second.run();
    EXPECT_TRUE(second.get<bool>("out"));
}

TEST(Mux2, Passes_the_chosen_input) {
    Instance mux("mux2");
    mux.set("in0", 1.5);
    mux.set("in1", -2.5);
    mux.run();
    EXPECT_EQ(mux.get<double>("out"), 1.5);
    mux.set("sel", true);
    mux.run();
    EXPECT_EQ(mux.get<double>("out"), -2.5);
}

TEST(Mux4, Counts_its_inputs_with_sel0_as_the_low_bit) {
    Instance mux("mux4");
    for (int i = 0; i < 4; ++i) {
        mux.set("in" + std::to_string(i), 10.0 + i);
    }
    for (int i = 0; i < 4; ++i) {
        mux.set("sel0", (i & 1) != 0);
        mux.set("sel1", (i & 2) != 0);
        mux.run();
        EXPECT_EQ(mux.get<double>("out"), 10.0 + i);
    }
}

TEST(Debounce, Follows_after_delay_cycles_and_ignores_shorter_pulses) {
    Instance filter("debounce", {{"cfg", "1"}});
    filter.set("delay", 3);
    EXPECT_EQ(response(filter,
                       "0110"
                       "111"
                       "0"
                       "11"
                       "000"
                       "0",
                       "0.in", "0.out"),
              "0000"
              "001"
              "1"
              "11"
              "111"
              "0");
}

TEST(Debounce, A_delay_of_zero_does_not_filter_and_a_negative_one_becomes_one) {
    Instance none("debounce", {{"cfg", "1"}});
    none.set("delay", 0);
    EXPECT_EQ(response(none, "0101101", "0.in", "0.out"), "0101101");
    for (const int delay : {1, -7}) {
        Instance filter("debounce", {{"cfg", "1"}});
        filter.set("delay", delay);
        EXPECT_EQ(response(filter, "0011001", "0.in", "0.out"), "0001100") << delay;
        EXPECT_EQ(filter.get<std::int32_t>("delay"), 1);
    }
}

TEST(Debounce, Survives_a_delay_that_shrinks) {
    Instance filter("debounce", {{"cfg", "1"}});
    filter.set("delay", 100);
    EXPECT_EQ(response(filter, "1111", "0.in", "0.out"), "0000");
    filter.set("delay", 2);
    EXPECT_EQ(response(filter,
                       "1"
                       "00000",
                       "0.in", "0.out"),
              "1"
              "11110");
}

TEST(Debounce, Makes_as_many_filters_as_cfg_says_each_on_its_own) {
    Instance group("debounce", {{"cfg", "3"}});
    EXPECT_TRUE(group.has_pin("2.in"));
    EXPECT_FALSE(group.has_pin("3.in"));
    EXPECT_EQ(group.get<std::int32_t>("delay"), 5);
    group.set("1.in", true);
    group.run(6);
    EXPECT_FALSE(group.get<bool>("0.out"));
    EXPECT_TRUE(group.get<bool>("1.out"));
    EXPECT_FALSE(group.get<bool>("2.out"));
    EXPECT_THROW(Instance("debounce", {{"cfg", "0"}}), std::runtime_error);
    EXPECT_THROW(Instance("debounce", {{"cfg", "two"}}), std::runtime_error);
}

TEST(Edge, Sees_the_falling_edge_by_default) {
    Instance edge("edge");
    EXPECT_EQ(response(edge, "0011001"), "0000100");
}

TEST(Edge, Sees_rising_or_both_edges_on_request) {
    Instance rising("edge");
    rising.set("in-edge", false);
    EXPECT_EQ(response(rising, "0011001"), "0010001");
    Instance both("edge");
    both.set("both", true);
    EXPECT_EQ(response(both, "0011001"), "0010101");
}

TEST(Edge, An_input_that_is_high_from_the_start_is_no_edge) {
    Instance edge("edge");
    edge.set("both", true);
    EXPECT_EQ(response(edge, "1110"), "0001");
}

TEST(Edge, Holds_the_pulse_for_whole_cycles_and_starts_it_again) {
    Instance edge("edge");
    edge.set("in-edge", false);
    edge.set("out-width-ns", 2'500'000);
    EXPECT_EQ(response(edge, "0111111"), "0111000");
    EXPECT_EQ(response(edge, "0101000000"), "0111110000");
}

TEST(Edge, Shows_the_inverse_and_the_time_left) {
    Instance edge("edge");
    edge.set("in-edge", false);
    edge.set("out-width-ns", 2'000'000);
    edge.run();
    EXPECT_TRUE(edge.get<bool>("out-invert"));
    edge.set("in", true);
    edge.run();
    EXPECT_FALSE(edge.get<bool>("out-invert"));
    EXPECT_EQ(edge.get<std::int32_t>("time-left-ns"), 2'000'000);
    EXPECT_TRUE(edge.get<bool>("last-in"));
    edge.run();
    EXPECT_EQ(edge.get<std::int32_t>("time-left-ns"), 1'000'000);
}

TEST(Flipflop, Stores_data_at_the_rising_edge_of_the_clock_only) {
    Instance flipflop("flipflop");
    flipflop.set("data", true);
    flipflop.run();
    EXPECT_FALSE(flipflop.get<bool>("out"));
    flipflop.set("clk", true);
    flipflop.run();
    EXPECT_TRUE(flipflop.get<bool>("out"));
    EXPECT_FALSE(flipflop.get<bool>("out-not"));
    flipflop.set("data", false);
    flipflop.run();
    EXPECT_TRUE(flipflop.get<bool>("out"));
    flipflop.set("clk", false);
    flipflop.run();
    EXPECT_TRUE(flipflop.get<bool>("out"));
    flipflop.set("clk", true);
    flipflop.run();
    EXPECT_FALSE(flipflop.get<bool>("out"));
    EXPECT_TRUE(flipflop.get<bool>("out-not"));
}

TEST(Flipflop, A_clock_that_is_high_in_the_first_cycle_is_an_edge) {
    Instance flipflop("flipflop");
    flipflop.set("data", true);
    flipflop.set("clk", true);
    flipflop.run();
    EXPECT_TRUE(flipflop.get<bool>("out"));
}

TEST(Flipflop, Reset_overrides_set_and_both_override_the_clock) {
    Instance flipflop("flipflop");
    flipflop.set("set", true);
    flipflop.run();
    EXPECT_TRUE(flipflop.get<bool>("out"));
    flipflop.set("clk", true);  // data is FALSE
    flipflop.run();
    EXPECT_TRUE(flipflop.get<bool>("out"));
    flipflop.set("reset", true);
    flipflop.run();
    EXPECT_FALSE(flipflop.get<bool>("out"));
    flipflop.set("set", false);
    flipflop.set("reset", false);
    flipflop.run();
    EXPECT_FALSE(flipflop.get<bool>("out"));
}

TEST(Flipflop, Takes_over_what_another_writer_puts_into_out) {
    Instance flipflop("flipflop");
    flipflop.run();
    flipflop.set("out", true);
    flipflop.run();
    EXPECT_TRUE(flipflop.get<bool>("out"));
    EXPECT_FALSE(flipflop.get<bool>("out-not"));
}

TEST(Oneshot, Pulses_for_its_width_after_a_rising_edge) {
    Instance oneshot("oneshot");
    oneshot.set("width", 0.0025);
    EXPECT_EQ(response(oneshot, "0111111"), "0111000");
    EXPECT_EQ(oneshot.get<double>("time-left"), 0.0);
    EXPECT_TRUE(oneshot.get<bool>("out-not"));
}

TEST(Oneshot, Starts_again_at_an_edge_unless_told_not_to) {
    Instance again("oneshot");
    again.set("width", 0.003);
    EXPECT_EQ(response(again, "01010000"), "01111100");
    Instance once("oneshot");
    once.set("width", 0.003);
    once.set("retriggerable", false);
    EXPECT_EQ(response(once, "01010000"), "01110000");
}

TEST(Oneshot, Chooses_its_edges) {
    Instance falling("oneshot");
    falling.set("width", 0.001);
    falling.set("rising", false);
    falling.set("falling", true);
    EXPECT_EQ(response(falling, "1100110"), "0010001");
}

TEST(Oneshot, Reset_ends_the_pulse_and_an_input_that_is_true_afterwards_is_an_edge) {
    Instance oneshot("oneshot");
    oneshot.set("width", 1.0);
    EXPECT_EQ(response(oneshot, "011"), "011");
    EXPECT_NEAR(oneshot.get<double>("time-left"), 0.999, 1e-12);
    oneshot.set("reset", true);
    EXPECT_EQ(response(oneshot, "101"), "000");
    oneshot.set("reset", false);
    EXPECT_EQ(response(oneshot, "0"), "0");
    EXPECT_EQ(response(oneshot, "1101"), "1111");
    oneshot.set("reset", true);
    EXPECT_EQ(response(oneshot, "11"), "00");
    oneshot.set("reset", false);
    EXPECT_EQ(response(oneshot, "1"), "1");
}

TEST(Oneshot, An_input_that_is_true_in_the_first_cycle_is_an_edge) {
    Instance oneshot("oneshot");
    oneshot.set("width", 0.002);
    EXPECT_EQ(response(oneshot, "1111"), "1100");
}

TEST(Oneshot, A_width_that_is_no_length_gives_no_pulse_and_a_huge_one_a_long_pulse) {
    Instance oneshot("oneshot");
    for (const double width : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
        oneshot.set("width", width);
        EXPECT_EQ(response(oneshot, "0110"), "0000") << width;
    }
    oneshot.set("width", std::numeric_limits<double>::infinity());
    EXPECT_EQ(response(oneshot, "0110"), "0111");
}

TEST(Toggle, Turns_over_with_each_press_once_it_has_held_for_debounce_cycles) {
    Instance toggle("toggle");
    EXPECT_EQ(response(toggle,
                       "0"
                       "1"
                       "0"
                       "111"
                       "000"
                       "11"
                       "0"),
              "0"
              "0"
              "0"
              "011"
              "111"
              "10"
              "0");
}

TEST(Toggle, A_bounce_at_the_release_is_no_press) {
    Instance toggle("toggle");
    EXPECT_EQ(response(toggle,
                       "11"
                       "0101"
                       "00"
                       "11"),
              "01"
              "1111"
              "11"
              "10");
}

TEST(Toggle, An_invalid_debounce_becomes_two) {
    for (const std::uint32_t invalid : {0u, 10'001u, UINT32_MAX}) {
        Instance toggle("toggle");
        toggle.set("debounce", invalid);
        EXPECT_EQ(response(toggle, "01011"), "00001");
        EXPECT_EQ(toggle.get<std::uint32_t>("debounce"), 2u);
    }
    Instance immediate("toggle");
    immediate.set("debounce", 1);
    EXPECT_EQ(response(immediate, "0101"), "0110");
}

TEST(Timedelay, Waits_on_both_edges) {
    Instance delay("timedelay");
    delay.set("on-delay", 0.003);
    delay.set("off-delay", 0.002);
    EXPECT_EQ(response(delay,
                       "0"
                       "11"
                       "0"
                       "1111"
                       "0"
                       "1"
                       "000"),
              "0"
              "00"
              "0"
              "0011"
              "1"
              "1"
              "100");
}

TEST(Timedelay, Shows_the_time_and_keeps_it) {
    Instance delay("timedelay");  // both delays are 0.5 s
    delay.set("in", true);
    delay.run(499);
    EXPECT_FALSE(delay.get<bool>("out"));
    EXPECT_NEAR(delay.get<double>("elapsed"), 0.499, 1e-12);
    delay.run();
    EXPECT_TRUE(delay.get<bool>("out"));
    EXPECT_NEAR(delay.get<double>("elapsed"), 0.5, 1e-12);
    delay.run();
    EXPECT_NEAR(delay.get<double>("elapsed"), 0.5, 1e-12);
}

TEST(Timedelay, Without_delay_follows_at_once) {
    Instance delay("timedelay");
    delay.set("on-delay", 0.0);
    delay.set("off-delay", -1.0);
    EXPECT_EQ(response(delay, "0110"), "0110");
}

}  // namespace
