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

TEST_F(Links, A_signal_has_one_output) {
    machine.rejected("net a x.bit-out y.bit-out", "two-writers");
}
TEST_F(Links, A_signal_with_an_output_takes_no_io_pin) {
    machine.rejected("net a x.bit-out y.bit-io", "two-writers");
}
TEST_F(Links, A_signal_with_io_pins_takes_no_output) {
    machine.rejected("net a x.bit-io y.bit-out", "two-writers");
}
TEST_F(Links, Types_must_be_equal) {
    machine.rejected("net a x.s32-out y.u32-in", "type-mismatch");
}
TEST_F(Links, A_pin_is_in_one_signal_only) {
    machine.rejected("net a x.bit-in\nnet b x.bit-in", "pin-linked");
}
TEST_F(Links, Parameters_are_not_linked) {
    machine.rejected("net a x.float-param", "parameter-link");
}
TEST_F(Links, A_signal_is_not_named_like_a_pin) {
    machine.rejected("net x.bit-in y.bit-in", "signal-named-like-pin");
}
TEST_F(Links, Net_without_pins_makes_no_signal) {
    machine.rejected("net nothing", "wrong-arguments");
}

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

TEST_F(Links, The_first_reader_hands_its_value_to_a_signal_without_writer) {
    machine.must("setp x.s32-in 7\nnewsig a s32\nsets a 3");
    machine.must("net a x.s32-in");
    EXPECT_EQ(machine.get("a"), "7");
    EXPECT_EQ(machine.get("x.s32-in"), "7");
}

TEST_F(Links, A_second_reader_takes_the_signals_value) {
    machine.must("setp x.s32-in 7\nsetp y.s32-in 8\nnet a x.s32-in");
    machine.must("net a y.s32-in");
    EXPECT_EQ(machine.get("a"), "7");
    EXPECT_EQ(machine.get("y.s32-in"), "7");
}

TEST_F(Links, Both_readers_in_one_line_take_the_first_ones_value) {
    machine.must("setp x.s32-in 7\nsetp y.s32-in 8\nnet a x.s32-in y.s32-in");
    EXPECT_EQ(machine.get("y.s32-in"), "7");
}

TEST_F(Links, A_writer_hands_its_value_to_the_signal) {
    machine.must("setp x.s32-in 41");
    machine.start();
    machine.cycles(1);
    machine.stop();
    machine.must("setp y.s32-in 9\nnet a y.s32-in");
    machine.must("net a x.s32-out");
    EXPECT_EQ(machine.get("a"), "41");
    EXPECT_EQ(machine.get("y.s32-in"), "41");
}

TEST_F(Links, An_io_pin_hands_its_value_to_a_signal_without_writer) {
    machine.must("setp x.s32-io 12\nsetp y.s32-in 9\nnet a y.s32-in");
    machine.must("net a x.s32-io");
    EXPECT_EQ(machine.get("a"), "12");
}

TEST_F(Links, A_second_io_pin_takes_the_signals_value) {
    machine.must("setp x.s32-io 12\nsetp y.s32-io 13\nnet a x.s32-io");
    machine.must("net a y.s32-io");
    EXPECT_EQ(machine.get("a"), "12");
    EXPECT_EQ(machine.get("y.s32-io"), "12");
}

TEST_F(Links, A_reader_of_a_written_signal_takes_its_value) {
    machine.must("setp x.s32-in 41\nsetp y.s32-in 5\nnet a x.s32-out");
    machine.start();
    machine.cycles(1);
    machine.stop();
    machine.must("net a y.s32-in");
    EXPECT_EQ(machine.get("y.s32-in"), "41");
}

TEST_F(Links, A_value_set_after_the_link_in_one_transaction_wins) {
    machine.must("setp x.s32-in 7\nnet a x.s32-in\nsets a 99");
    EXPECT_EQ(machine.get("a"), "99");
    EXPECT_EQ(machine.get("x.s32-in"), "99");
}

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

TEST_F(Links, Setp_rejects_outputs) { machine.rejected("setp x.bit-out 1", "output-set"); }
TEST_F(Links, Sets_rejects_signals_with_a_writer) {
    machine.rejected("net a x.bit-out\nsets a 1", "writer-set");
}
TEST_F(Links, Setp_of_nothing_is_an_error) { machine.rejected("setp x.bit-inn 1", "no-such-pin"); }
TEST_F(Links, Sets_of_nothing_is_an_error) { machine.rejected("sets nowhere 1", "no-such-signal"); }
TEST_F(Links, Setp_rejects_linked_pins) {
    machine.must("net a x.bit-in");
    machine.rejected("setp x.bit-in 1", "linked-set");
}

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
