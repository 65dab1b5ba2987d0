// SPDX-License-Identifier: MIT
// LinuxCNC's rules of signals, links and values, on the virtual clock.
#include "machine.hpp"

namespace hal::test {
namespace {

// x and y: a pin of every type and direction each; both in thread t.
struct Links : testing::Test {
    Links() {
        machine.must(
            "loadrt threads name1=t period1=1000000\nloadrt test-types names=x,y,z\naddf x t\naddf "
            "y t\naddf z t\n");
    }
    Machine machine;
};

TEST_F(Links, Net_makes_the_signal_with_the_type_of_its_first_pin) {
    machine.must("net a x.s64-out => y.s64-in");
    EXPECT_EQ(machine.session.model().find_signal("a")->type, HAL_TYPE_S64);
}

struct Rejection {
    const char* name;
    const char* before;  ///< edits of the transaction before; empty: none
    const char* text;
    const char* code;
};
struct RejectedLinks : Links, testing::WithParamInterface<Rejection> {};

TEST_P(RejectedLinks, change_nothing) {
    const Rejection& row = GetParam();
    machine.must(row.before);
    machine.rejected(row.text, row.code);
}

INSTANTIATE_TEST_SUITE_P(
    Rules, RejectedLinks,
    testing::Values(
        Rejection{"two_outputs", "", "net a x.bit-out y.bit-out", "two-writers"},
        Rejection{"io_pin_beside_an_output", "", "net a x.bit-out y.bit-io", "two-writers"},
        Rejection{"output_beside_an_io_pin", "", "net a x.bit-io y.bit-out", "two-writers"},
        Rejection{"unequal_types", "", "net a x.s32-out y.u32-in", "type-mismatch"},
        Rejection{"pin_in_two_signals", "", "net a x.bit-in\nnet b x.bit-in", "pin-linked"},
        Rejection{"parameter", "", "net a x.float-param", "parameter-link"},
        Rejection{"signal_named_like_a_pin", "", "net x.bit-in y.bit-in", "signal-named-like-pin"},
        Rejection{"net_without_pins", "", "net nothing", "wrong-arguments"},
        Rejection{"setp_of_an_output", "", "setp x.bit-out 1", "output-set"},
        Rejection{"setp_of_a_linked_pin", "net a x.bit-in", "setp x.bit-in 1", "linked-set"},
        Rejection{"setp_of_nothing", "", "setp x.bit-inn 1", "no-such-pin"},
        Rejection{"sets_beside_a_writer", "", "net a x.bit-out\nsets a 1", "writer-set"},
        Rejection{"sets_of_nothing", "", "sets nowhere 1", "no-such-signal"}),
    [](const auto& row) { return row.param.name; });

TEST_F(Links, Io_pins_share_one_value_within_a_thread) {
    machine.must("net a x.s32-io y.s32-io => z.s32-in\nsets a 5");
    machine.start();
    machine.cycles(1);
    EXPECT_EQ(machine.get("x.s32-io"), "5");
    EXPECT_EQ(machine.get("y.s32-io"), "5");
    EXPECT_EQ(machine.get("z.s32-out"), "5");
}

TEST_F(Links, A_pin_linked_to_the_same_signal_again_is_accepted) {
    machine.must("net a x.bit-out y.bit-in");
    machine.must("net a x.bit-out y.bit-in z.bit-in");
    EXPECT_EQ(machine.session.model().find_signal("a")->readers, 2u);
}

TEST_F(Links, Linkps_linksp_and_linkpp_link_as_net_does) {
    machine.must(
        "newsig a s32\nlinkps x.s32-out => a\nlinksp a => y.s32-in\nlinkpp x.bit-out y.bit-in");
    EXPECT_EQ(machine.session.model().find_signal("a")->pins.size(), 2u);
    ASSERT_NE(machine.session.model().find_pin("y.bit-in")->signal, nullptr);
    EXPECT_EQ(machine.session.model().find_pin("y.bit-in")->signal,
              machine.session.model().find_pin("x.bit-out")->signal);
    machine.rejected("linkpp x.bit-out y.bit-io", "pin-linked");
    machine.rejected("linkpp y.bit-io x.bit-out", "pin-linked");
    machine.rejected("linkpp x.bit-out y.bit-in", "pin-linked");
    machine.rejected("net a", "wrong-arguments");
    machine.rejected("net a =>", "wrong-arguments");
    machine.rejected("net fresh =>", "wrong-arguments");
    machine.rejected("linkps x.bit-io a", "type-mismatch");
    machine.rejected("linkps x.bit-io nowhere", "no-such-signal");
}

// --- which value a fresh link has ------------------------------------------------------------------------------------

/// What a pin has after it was linked.
struct FreshLink {
    const char* name;
    const char* before;  ///< a transaction of its own
    bool ran;            ///< for a cycle, after that transaction
    const char* linking;
    std::vector<std::pair<const char*, const char*>> expected;
};
struct FreshLinks : Links, testing::WithParamInterface<FreshLink> {};

TEST_P(FreshLinks, have_the_value) {
    const FreshLink& row = GetParam();
    machine.must(row.before);
    if (row.ran) {
        machine.start();
        machine.cycles(1);
        machine.stop();
    }
    machine.must(row.linking);
    for (const auto& [name, value] : row.expected) {
        EXPECT_EQ(machine.get(name), value) << name;
    }
}

INSTANTIATE_TEST_SUITE_P(
    Rules, FreshLinks,
    testing::Values(FreshLink{"of_the_first_reader",
                              "setp x.s32-in 7\nnewsig a s32\nsets a 3",
                              false,
                              "net a x.s32-in",
                              {{"a", "7"}, {"x.s32-in", "7"}}},
                    FreshLink{"of_the_signal_for_a_second_reader",
                              "setp x.s32-in 7\nsetp y.s32-in 8\nnet a x.s32-in",
                              false,
                              "net a y.s32-in",
                              {{"a", "7"}, {"y.s32-in", "7"}}},
                    FreshLink{"of_the_first_of_two_readers_in_a_line",
                              "setp x.s32-in 7\nsetp y.s32-in 8",
                              false,
                              "net a x.s32-in y.s32-in",
                              {{"y.s32-in", "7"}}},
                    FreshLink{"of_the_writer",
                              "setp x.s32-in 41\nsetp y.s32-in 9\nnet a y.s32-in",
                              true,
                              "net a x.s32-out",
                              {{"a", "41"}, {"y.s32-in", "41"}}},
                    FreshLink{"of_an_io_pin",
                              "setp x.s32-io 12\nsetp y.s32-in 9\nnet a y.s32-in",
                              false,
                              "net a x.s32-io",
                              {{"a", "12"}}},
                    FreshLink{"of_the_signal_for_a_second_io_pin",
                              "setp x.s32-io 12\nsetp y.s32-io 13\nnet a x.s32-io",
                              false,
                              "net a y.s32-io",
                              {{"a", "12"}, {"y.s32-io", "12"}}},
                    FreshLink{"of_the_signal_for_its_reader",
                              "setp x.s32-in 41\nsetp y.s32-in 5\nnet a x.s32-out",
                              true,
                              "net a y.s32-in",
                              {{"y.s32-in", "41"}}},
                    FreshLink{"that_sets_gave_in_the_same_transaction",
                              "",
                              false,
                              "setp x.s32-in 7\nnet a x.s32-in\nsets a 99",
                              {{"a", "99"}, {"x.s32-in", "99"}}}),
    [](const auto& row) { return row.param.name; });

TEST_F(Links, A_pin_set_before_its_link_in_one_transaction_brings_that_value) {
    machine.must("net b y.s32-in");  // x.s32-in is owned by a thread by now
    machine.start();
    machine.cycles(1);
    machine.must("setp x.s32-in 70\nnet a x.s32-in");
    EXPECT_EQ(machine.get("a"), "70");
}

// --- unlinking ---------------------------------------------------------------------------------------------------------

struct Kept {
    const char *type, *value;
};
struct Unlinked : Links, testing::WithParamInterface<Kept> {};

TEST_P(Unlinked, pin_keeps_the_last_value_of_its_signal) {
    const std::string in = std::string("x.") + GetParam().type + "-in";
    machine.must("net a " + in + "\nsets a " + GetParam().value);
    machine.start();
    machine.cycles(2);
    machine.must("unlinkp " + in);
    EXPECT_EQ(machine.get(in), GetParam().value);
    machine.cycles(2);
    EXPECT_EQ(machine.get(in), GetParam().value);
    EXPECT_EQ(machine.get(std::string("x.") + GetParam().type + "-out"), GetParam().value);
    EXPECT_EQ(machine.session.model().find_pin(in)->signal, nullptr);
}
INSTANTIATE_TEST_SUITE_P(Types, Unlinked,
                         testing::Values(Kept{"bit", "TRUE"}, Kept{"float", "-2.5e-07"},
                                         Kept{"s32", "-2147483648"}, Kept{"u32", "4294967295"},
                                         Kept{"s64", "-9223372036854775807"},
                                         Kept{"u64", "18446744073709551615"}),
                         [](const auto& kept) { return kept.param.type; });

TEST_F(Links, An_unlinked_output_keeps_its_value_and_goes_on_writing_its_own) {
    machine.must("setp x.s64-in 123456789012345\nnet a x.s64-out => y.s64-in");
    machine.start();
    machine.cycles(1);
    machine.must("unlinkp x.s64-out");
    EXPECT_EQ(machine.get("x.s64-out"), "123456789012345");
    EXPECT_EQ(machine.get("a"), "123456789012345");
    machine.must("setp x.s64-in 4\nsets a 5");
    machine.cycles(1);
    EXPECT_EQ(machine.get("x.s64-out"), "4");
    EXPECT_EQ(machine.get("y.s64-out"), "5");
}

TEST_F(Links, Unlinkp_of_an_unlinked_pin_does_nothing) { machine.must("unlinkp x.bit-in"); }

TEST_F(Links, Delsig_leaves_its_pins_with_the_last_value) {
    machine.must("net a x.u32-in y.u32-in\nsets a 17");
    machine.must("delsig a");
    EXPECT_EQ(machine.get("x.u32-in"), "17");
    EXPECT_EQ(machine.get("y.u32-in"), "17");
    EXPECT_EQ(machine.get("a"), "?");
    machine.rejected("delsig a", "no-such-signal");
}

TEST_F(Links, Delsig_all_takes_every_signal) {
    machine.must("net a x.u32-in\nnet b x.bit-out y.bit-in\nnewsig c float");
    machine.must("delsig all");
    EXPECT_TRUE(machine.session.model().signals.empty());
}

TEST_F(Links, Linked_and_unlinked_in_one_transaction_keeps_what_was_inherited) {
    machine.must("setp x.s32-in 7\nsetp y.s32-in 8");
    machine.must("net a x.s32-in y.s32-in\nunlinkp y.s32-in");
    EXPECT_EQ(machine.get("y.s32-in"), "7");
}

// --- setp and sets -----------------------------------------------------------------------------------------------------

TEST_F(Links, Setp_takes_parameters_io_pins_and_the_equals_sign) {
    machine.must("setp x.float-param 2.5\nsetp x.s32-io -3\ny.s32-in = 6");
    EXPECT_EQ(machine.get("x.float-param"), "2.5");
    EXPECT_EQ(machine.get("x.s32-io"), "-3");
    EXPECT_EQ(machine.get("y.s32-in"), "6");
}

struct BadValue {
    const char *pin, *value;
};
struct Refused : Links, testing::WithParamInterface<BadValue> {};
TEST_P(Refused, value_changes_nothing) {
    machine.rejected(std::string("setp x.") + GetParam().pin + " " + GetParam().value, "bad-value");
}
INSTANTIATE_TEST_SUITE_P(Values, Refused,
                         testing::Values(BadValue{"s64-in", "9223372036854775808"},
                                         BadValue{"u64-in", "18446744073709551616"},
                                         BadValue{"bit-in", "maybe"}, BadValue{"float-in", "1.5x"},
                                         BadValue{"s32-in", "1.5"}, BadValue{"s32-in", "0x"}));

TEST_F(Links, Values_are_read_in_every_way_they_may_be_written) {
    machine.must(
        "setp x.s32-in 0x1F\nsetp x.u32-in 017\nsetp x.bit-in Yes\nsetp x.float-in 1e3\nsetp "
        "x.u64-in 0xFFFFFFFFFFFFFFFF");
    EXPECT_EQ(machine.get("x.s32-in"), "31");
    EXPECT_EQ(machine.get("x.u32-in"), "15");
    EXPECT_EQ(machine.get("x.bit-in"), "TRUE");
    EXPECT_EQ(machine.get("x.float-in"), "1000");
    EXPECT_EQ(machine.get("x.u64-in"), "18446744073709551615");
}

TEST_F(Links, Getp_after_setp_and_gets_after_sets_see_the_new_value) {
    machine.must("net a x.s32-in y.s32-in");
    machine.start();
    machine.cycles(1);
    for (int i = 0; i < 100; ++i) {
        machine.must("sets a " + std::to_string(i) + "\nsetp x.u32-in " + std::to_string(i));
        ASSERT_EQ(machine.number("a"), i);
        ASSERT_EQ(machine.number("y.s32-in"), i);
        ASSERT_EQ(machine.number("x.u32-in"), i);
    }
}

// --- types ----------------------------------------------------------------------------------------------------------------

TEST_F(Links, Newsig_knows_both_dialects) {
    machine.must(
        "newsig a bool\nnewsig b real\nnewsig c sint\nnewsig d uint\nnewsig e port\nnewsig f "
        "si32\nnewsig g ui32");
    const Model& model = machine.session.model();
    EXPECT_EQ(model.find_signal("a")->type, HAL_TYPE_BIT);
    EXPECT_EQ(model.find_signal("b")->type, HAL_TYPE_FLOAT);
    EXPECT_EQ(model.find_signal("c")->type, HAL_TYPE_S64);
    EXPECT_EQ(model.find_signal("d")->type, HAL_TYPE_U64);
    EXPECT_EQ(model.find_signal("e")->type, HAL_TYPE_PORT);
    EXPECT_EQ(model.find_signal("f")->type, HAL_TYPE_S32);
    EXPECT_EQ(model.find_signal("g")->type, HAL_TYPE_U32);
    machine.rejected("newsig h double", "no-such-type");
    machine.rejected("newsig a bit", "name-taken");
}

// --- aliases ----------------------------------------------------------------------------------------------------------------

TEST_F(Links, An_alias_is_a_second_name_for_every_command) {
    machine.must("alias pin x.s32-in speed");
    machine.must("setp speed 5");
    EXPECT_EQ(machine.get("x.s32-in"), "5");
    EXPECT_EQ(machine.get("speed"), "5");
    machine.must("net a speed");
    EXPECT_NE(machine.session.model().find_pin("x.s32-in")->signal, nullptr);
    machine.must("unlinkp speed\nunalias pin speed");
    EXPECT_EQ(machine.get("speed"), "?");
    EXPECT_EQ(machine.get("x.s32-in"), "5");
}

TEST_F(Links, Aliases_are_unique_and_a_second_one_replaces_the_first) {
    machine.must("alias pin x.s32-in speed\nalias param x.float-param gain\nnewsig sig bit");
    machine.must("alias pin x.s32-in other\nalias pin other third");
    EXPECT_EQ(machine.get("speed"), "?");
    EXPECT_EQ(machine.get("other"), "?");
    EXPECT_EQ(machine.get("third"), machine.get("x.s32-in"));
    machine.must("alias pin third speed");
    machine.rejected("alias pin x.s32-in speed", "name-taken");
    machine.rejected("alias pin y.s32-in speed", "name-taken");
    machine.rejected("alias pin y.s32-in y.bit-in", "name-taken");
    machine.rejected("alias pin y.s32-in sig", "name-taken");
    machine.rejected("alias signal sig other", "wrong-arguments");
    machine.must("unalias pin y.s32-in\nunalias pin y.s32-in");
    machine.rejected("unalias pin nowhere", "no-such-pin");
    machine.rejected("alias pin nowhere other", "no-such-pin");
    machine.rejected("newsig speed bit", "signal-named-like-pin");
}

TEST_F(Links, An_alias_goes_with_its_instance) {
    machine.must("alias pin x.s32-in speed");
    machine.must("unloadrt x");
    EXPECT_EQ(machine.get("speed"), "?");
    machine.must("alias pin y.s32-in speed");
}

// --- ports ------------------------------------------------------------------------------------------------------------------

struct Ports : testing::Test {
    Ports() {
        machine.must(
            "loadrt threads name1=t period1=1000000\nloadrt test-port names=p,q,r\naddf p t\naddf "
            "q t\n");
    }
    Machine machine;
};

TEST_F(Ports, A_stream_runs_once_its_signal_has_a_buffer) {
    machine.must("net s p.to => q.from");
    machine.start();
    machine.cycles(5);
    EXPECT_EQ(machine.get("p.written"), "0");
    machine.must("sets s 16");
    machine.cycles(10);
    EXPECT_EQ(machine.get("p.room"), "16");
    EXPECT_EQ(machine.get("p.written"), "10");
    EXPECT_EQ(machine.get("q.read"), "10");
    EXPECT_EQ(machine.get("q.wrong"), "0");
}

TEST_F(Ports, A_full_stream_takes_no_more_and_loses_nothing) {
    machine.must("net s p.to => r.from\nsets s 8");  // r runs in no thread
    machine.start();
    machine.cycles(20);
    EXPECT_EQ(machine.get("p.written"), "8");
    machine.must("addf r t");
    machine.cycles(2);
    EXPECT_EQ(machine.get("r.wrong"), "0");
    EXPECT_GE(machine.number("r.read"), 8);
}

TEST_F(Ports, A_stream_crosses_threads) {
    machine.must("delf q t\nnewthread slow 4000000\naddf q slow\nnet s p.to => q.from\nsets s 64");
    machine.start();
    machine.cycles(40);
    EXPECT_EQ(machine.get("p.written"), "40");
    EXPECT_GE(machine.number("q.read"), 32);
    EXPECT_EQ(machine.get("q.wrong"), "0");
}

TEST_F(Ports, Accept_one_reader_one_writer_and_one_size) {
    machine.rejected("net s p.to q.from r.from", "two-readers");
    machine.rejected("net s p.to q.to", "two-writers");
    machine.must("net s p.to q.from\nsets s 8");
    machine.rejected("sets s 16", "port-sized");
    machine.rejected("newsig t port\nsets t 0", "bad-value");
    machine.rejected("setp q.from 3", "linked-set");
    machine.rejected("setp r.from 3", "bad-value");
}

TEST_F(Ports, An_unlinked_port_pin_has_no_stream) {
    machine.must("net s p.to => q.from\nsets s 8");
    machine.start();
    machine.cycles(3);
    machine.must("unlinkp p.to");
    machine.cycles(3);
    EXPECT_EQ(machine.get("p.room"), "0");
    EXPECT_EQ(machine.get("p.written"), "3");
    machine.must("delsig s");  // the buffer is gone with it
    machine.cycles(3);
    EXPECT_EQ(machine.get("q.read"), "3");
}

TEST_F(Ports, A_deleted_port_signal_is_forgotten_by_pins_in_no_thread_too) {
    machine.must("net s p.to => r.from\nsets s 8");
    machine.must("delf p t\ndelsig s");
    machine.must("addf p t\naddf r t");
    machine.start();
    machine.cycles(3);
    EXPECT_EQ(machine.get("p.written"), "0");
    EXPECT_EQ(machine.get("r.read"), "0");
}

}  // namespace
}  // namespace hal::test
