// SPDX-License-Identifier: MIT
#include "tests/unit/netlist_text.hpp"

namespace {

class Expansion : public netlist_text::Netlist {
protected:
    /// Returns the diagnostics of a text that must be rejected after expansion, without any
    /// command.
    std::string refused(std::string text) {
        EXPECT_EQ(expanded(std::move(text)), "");
        return render(found, sources);
    }
};

TEST_F(Expansion, returns_a_command_without_ranges_unchanged) {
    const auto plain = parse("net a b..c } ] <= p.out => 'q.in'");
    ASSERT_EQ(plain.size(), 1u);
    const auto same = hal::expand(plain[0], found);
    ASSERT_EQ(same.size(), 1u);
    EXPECT_EQ(netlist_text::joined(same), "net a b..c } ] <= p.out => 'q.in'\n");
    EXPECT_EQ(in_source(same[0].args[0].span), "a");
    EXPECT_EQ(render(found, sources), "");
}

TEST_F(Expansion, makes_a_command_per_name_of_the_first_argument) {
    EXPECT_EQ(expanded("net j[0..2]-cmd  traj.[0..2].out => pid.[0..2].command"),
              R"(net j0-cmd traj.0.out => pid.0.command
net j1-cmd traj.1.out => pid.1.command
net j2-cmd traj.2.out => pid.2.command
)");
    EXPECT_EQ(expanded("setp pid.[0..2].Pgain 10"),
              "setp pid.0.Pgain 10\nsetp pid.1.Pgain 10\nsetp pid.2.Pgain 10\n");
    EXPECT_EQ(expanded("addf pid.[0..2].do-pid-calcs servo-thread"),
              "addf pid.0.do-pid-calcs servo-thread\naddf pid.1.do-pid-calcs servo-thread\naddf "
              "pid.2.do-pid-calcs servo-thread\n");
    EXPECT_EQ(expanded("getp {a,b}.out"), "getp a.out\ngetp b.out\n");
}

TEST_F(Expansion, lists_names_in_place_when_the_first_argument_has_one) {
    EXPECT_EQ(expanded("net on s.on => pid.{x,y,z}.enable"),
              "net on s.on => pid.x.enable pid.y.enable pid.z.enable\n");
    EXPECT_EQ(expanded("net on a[0..1] => b[0..2]"), "net on a0 a1 => b0 b1 b2\n");
    EXPECT_EQ(expanded("show pin pid.[0..1].*"), "show pin pid.0.* pid.1.*\n");
}

TEST_F(Expansion, makes_comma_lists_of_load_arguments) {
    EXPECT_EQ(expanded("loadrt pid names={x,y}-pid"), "loadrt pid names=x-pid,y-pid\n");
    EXPECT_EQ(expanded("loadrt pid names=spindle,{x,y}-pid,a[0..1] debug=1"),
              "loadrt pid names=spindle,x-pid,y-pid,a0,a1 debug=1\n");
    EXPECT_EQ(expanded("loadrt x cfg=[0..0]"), "loadrt x cfg=0\n");
    EXPECT_EQ(expanded("loadrt {and2,or2} names={a,b} x={c,d}"),
              "loadrt and2 names=a x=c\nloadrt or2 names=b x=d\n");
    EXPECT_EQ(expanded("loadrt x cfg=\"{a,b}\" names={a,b}"), "loadrt x cfg=\"{a,b}\" names=a,b\n");
}

TEST_F(Expansion, is_about_the_name_in_front_of_an_equal_sign) {
    EXPECT_EQ(expanded("pid.[0..1].Pgain = 3"), "pid.0.Pgain = 3\npid.1.Pgain = 3\n");
    EXPECT_EQ(expanded("pid.[0..1].Pgain = [3..4]"), "pid.0.Pgain = 3\npid.1.Pgain = 4\n");
}

TEST_F(Expansion, of_alias_is_about_its_second_argument) {
    EXPECT_EQ(expanded("alias pin pid.[0..1].output {x,y}-effort"),
              "alias pin pid.0.output x-effort\nalias pin pid.1.output y-effort\n");
    EXPECT_EQ(expanded("unalias pin {x,y}-effort"), "unalias pin x-effort\nunalias pin y-effort\n");
}

TEST_F(Expansion, counts_up_down_and_with_leading_zeros) {
    EXPECT_EQ(expanded("getp a[2..0]"), "getp a2\ngetp a1\ngetp a0\n");
    EXPECT_EQ(expanded("getp a[08..11]b"), "getp a08b\ngetp a09b\ngetp a10b\ngetp a11b\n");
    EXPECT_EQ(expanded("getp a[8..010]"), "getp a008\ngetp a009\ngetp a010\n");
    EXPECT_EQ(expanded("getp a[9..11]"), "getp a9\ngetp a10\ngetp a11\n");
    EXPECT_EQ(expanded("getp [7..7]"), "getp 7\n");
}

TEST_F(Expansion, combines_several_ranges_of_a_word_in_reading_order) {
    EXPECT_EQ(expanded("getp {x,y}.[0..1].{in}"),
              "getp x.0.in\ngetp x.1.in\ngetp y.0.in\ngetp y.1.in\n");
    EXPECT_EQ(expanded("net s-[0..1][0..1] a.[0..3]"),
              "net s-00 a.0\nnet s-01 a.1\nnet s-10 a.2\nnet s-11 a.3\n");
}

TEST_F(Expansion, repeats_arguments_without_a_range) {
    EXPECT_EQ(expanded("net s[0..1] a.out => b.[0..1].in c.in"),
              "net s0 a.out => b.0.in c.in\nnet s1 a.out => b.1.in c.in\n");
}

TEST_F(Expansion, works_on_values_of_references) {
    EXPECT_EQ(expanded("setp pid.$(LIST).gain 3"), "setp pid.x.gain 3\nsetp pid.y.gain 3\n");
}

TEST_F(Expansion, leaves_quotes_alone) {
    EXPECT_EQ(expanded("setp \"{a,b}\"[0..1] '[0..1]'"),
              "setp \"{a,b}\"0 '[0..1]'\nsetp \"{a,b}\"1 '[0..1]'\n");
}

TEST_F(Expansion, points_at_the_word_a_name_came_from) {
    const auto commands = parse("net j[0..1] a.{x,y}.out");
    ASSERT_EQ(commands.size(), 1u);
    const auto two = hal::expand(commands[0], found);
    ASSERT_EQ(two.size(), 2u);
    EXPECT_EQ(in_source(two[1].args[0].span), "j[0..1]");
    EXPECT_EQ(in_source(two[1].args[1].span), "a.{x,y}.out");
    EXPECT_EQ(in_source(two[1].span), "net j[0..1] a.{x,y}.out");
}

TEST_F(Expansion, refuses_different_numbers_of_names) {
    EXPECT_EQ(
        refused("net j[0..2] pid.[0..3].command"),
        R"(test.hal:1:13: error: 'j[0..2]' expands to 3 names, 'pid.[0..3].command' to 4 [range-length]
    1 | net j[0..2] pid.[0..3].command
      |     ------- ^^^^^^^^^^^^^^^^^^ 4 names
      |     3 names
      = help: ranges and sets of one command are expanded in parallel, so they need the same number of names
)");
}

TEST_F(Expansion, refuses_malformed_ranges_and_sets) {
    EXPECT_EQ(refused("getp a[0..x]\ngetp a[..3]\ngetp a[0..]\ngetp a[1.5..2]\ngetp a[-1..1]\ngetp "
                      "a[0..9999999999999999999]\n"),
              R"(test.hal:1:7: error: the bounds of a range must be whole numbers [bad-range]
    1 | getp a[0..x]
      |       ^^^^^^
      = help: write [0..5], [00..11] or [5..0]; for a list of names write {x,y,z}

test.hal:2:7: error: the bounds of a range must be whole numbers [bad-range]
    2 | getp a[..3]
      |       ^^^^^
      = help: write [0..5], [00..11] or [5..0]; for a list of names write {x,y,z}

test.hal:3:7: error: the bounds of a range must be whole numbers [bad-range]
    3 | getp a[0..]
      |       ^^^^^
      = help: write [0..5], [00..11] or [5..0]; for a list of names write {x,y,z}

test.hal:4:7: error: the bounds of a range must be whole numbers [bad-range]
    4 | getp a[1.5..2]
      |       ^^^^^^^^
      = help: write [0..5], [00..11] or [5..0]; for a list of names write {x,y,z}

test.hal:5:7: error: the bounds of a range must be whole numbers [bad-range]
    5 | getp a[-1..1]
      |       ^^^^^^^
      = help: write [0..5], [00..11] or [5..0]; for a list of names write {x,y,z}

test.hal:6:7: error: the bounds of this range are too large [bad-range]
    6 | getp a[0..9999999999999999999]
      |       ^^^^^^^^^^^^^^^^^^^^^^^^
)");
    found.clear();
    EXPECT_EQ(refused("getp a{x\ngetp {}\ngetp {a,,b}\ngetp {a,{b,c}}\ngetp {a,[0..1]}\n"),
              R"(test.hal:1:7: error: missing } of this set [bad-range]
    1 | getp a{x
      |       ^
      = help: write a set as {x,y,z}, without spaces

test.hal:2:6: error: empty name in this set [bad-range]
    2 | getp {}
      |      ^^
      = help: write a set as {x,y,z}

test.hal:3:6: error: empty name in this set [bad-range]
    3 | getp {a,,b}
      |      ^^^^^^
      = help: write a set as {x,y,z}

test.hal:4:6: error: sets cannot be nested [bad-range]
    4 | getp {a,{b,c}}
      |      ^^^^
      = help: list all names in one set: {x,y,z}

test.hal:5:6: error: a set cannot contain a range [bad-range]
    5 | getp {a,[0..1]}
      |      ^^^^^^^^^^
      = help: write the range without the set: [0..5]
)");
}

TEST_F(Expansion, of_a_million_names_works_and_of_one_more_is_refused) {
    const auto commands = parse(
        "getp p[1..1000000]\ngetp p[0..1000000]\nshow pin [1..1000][1..1001]\nloadrt x "
        "names=[1..1000000],y\n");
    ASSERT_EQ(commands.size(), 4u);
    EXPECT_EQ(hal::expand(commands[0], found).size(), 1'000'000u);
    EXPECT_EQ(found.errors(), 0u);
    for (std::size_t i = 1; i < 4; ++i) {
        EXPECT_TRUE(hal::expand(commands[i], found).empty());
    }
    EXPECT_EQ(render(found, sources),
              R"(test.hal:2:7: error: this word expands to more than 1000000 names [bad-range]
    2 | getp p[0..1000000]
      |       ^^^^^^^^^^^^

test.hal:3:19: error: this word expands to more than 1000000 names [bad-range]
    3 | show pin [1..1000][1..1001]
      |                   ^^^^^^^^^

test.hal:4:10: error: this word expands to more than 1000000 names [bad-range]
    4 | loadrt x names=[1..1000000],y
      |          ^^^^^^^^^^^^^^^^^^^^
)");
}

TEST_F(Expansion, is_bounded_in_memory) {
    const std::string long_name(10'000, 'n');
    EXPECT_EQ(expanded("setp p[1..1000000] " + long_name), "");
    EXPECT_EQ(expanded("net s " + long_name + "[1..1000000]"), "");
    EXPECT_EQ(expanded("net s a[1..600000] b[1..600000]"), "");
    EXPECT_EQ(found.errors(), 3u);
    for (const auto& error : found.all()) {
        EXPECT_EQ(error.message, "the ranges of this command expand to too many names");
    }
}

}  // namespace
