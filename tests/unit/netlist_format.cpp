// SPDX-License-Identifier: MIT
#include "tests/unit/netlist_text.hpp"

namespace {

class Formatter : public netlist_text::Netlist {
protected:
    /// The text formatted; checked to be stable and to mean the same.
    std::string formatted(const std::string& text) {
        const auto source = add(text);
        const std::string once = hal::format(sources, source, found);
        EXPECT_FALSE(found.failed()) << render(found, sources);
        const auto again = add(once);
        EXPECT_EQ(hal::format(sources, again, found), once);
        const hal::Environment values{.ini = nullptr, .variable = [](const std::string& name) {
            return std::optional("<" + name + " " + name + ">");
        }};
        hal::Diagnostics local;
        EXPECT_EQ(netlist_text::joined(hal::parse(sources, source, values, local)),
                  netlist_text::joined(hal::parse(sources, again, values, local)));
        return once;
    }
};

TEST_F(Formatter, aligns_blocks_of_equal_commands) {
    EXPECT_EQ(formatted(R"(loadrt pid names=pos
loadrt encoder   names=arm,pendulum num_chan=2
addf arm.update-counters base-thread
addf  pos.do-pid-calcs   servo-thread  1
net arm-angle arm.position => pos.feedback
net effort pos.output => motor.value
net a x y z <= w
setp pos.Pgain 10
setp pos.maxoutput   24.0
start
)"),
              R"(loadrt pid     names=pos
loadrt encoder names=arm,pendulum num_chan=2
addf arm.update-counters base-thread
addf pos.do-pid-calcs    servo-thread 1
net arm-angle arm.position => pos.feedback
net effort    pos.output   => motor.value
net a         x y z        <= w
setp pos.Pgain     10
setp pos.maxoutput 24.0
start
)");
}

TEST_F(Formatter, ends_a_block_at_a_blank_line_and_at_a_comment) {
    EXPECT_EQ(formatted("setp a 1\n\nsetp long-name 2\n# note\nsetp b 3\n"),
              "setp a 1\n\nsetp long-name 2\n# note\nsetp b 3\n");
}

TEST_F(Formatter, keeps_comments_and_aligns_those_behind_commands) {
    EXPECT_EQ(
        formatted("  # head  \n#!shebang\nsetp a.long 1 # one\nsetp b 2\nsetp c 3     # three\n"),
        "# head\n#!shebang\nsetp a.long 1  # one\nsetp b      2\nsetp c      3  # three\n");
}

TEST_F(Formatter, keeps_up_to_two_blank_lines_and_none_at_the_ends) {
    EXPECT_EQ(formatted("\n\nstart\n\n\n\n\nstop\n\nshow\n\n\n"), "start\n\n\nstop\n\nshow\n");
    EXPECT_EQ(formatted(""), "");
    EXPECT_EQ(formatted("\n \n"), "");
    EXPECT_EQ(formatted("start"), "start\n");
}

TEST_F(Formatter, joins_continued_lines_that_fit) {
    EXPECT_EQ(formatted("net a \\\n   b.out \\\n   => c.in # d\n"), "net a b.out => c.in  # d\n");
}

TEST_F(Formatter, keeps_the_line_breaks_of_long_commands) {
    const std::string pin(30, 'p');
    EXPECT_EQ(formatted("net signal " + pin + ".1 \\\n\t" + pin + ".2   " + pin + ".3 \\\n=> " +
                        pin + ".4 # end\n"),
              "net signal " + pin + ".1 \\\n    " + pin + ".2 " + pin + ".3 \\\n    => " + pin +
                  ".4  # end\n");
}

TEST_F(Formatter, keeps_a_word_together_that_a_line_break_cut) {
    EXPECT_EQ(formatted("se\\\ntp a \"x \\\n  y\"\n"), "setp a \"x   y\"\n");
}

TEST_F(Formatter, keeps_what_stands_between_quotes_and_in_references) {
    EXPECT_EQ(
        formatted("print   \"a   b\"  'c  # d'\nsetp  x  [MY  SECTION](A  KEY)  $(V  W)\nshow  pin "
                  " pid.[0 1]*\n"),
        "print \"a   b\" 'c  # d'\nsetp x [MY  SECTION](A  KEY) $(V  W)\nshow  pin  pid.[0 1]*\n");
}

TEST_F(Formatter, aligns_assignments) {
    EXPECT_EQ(formatted("a.b = 1\nlong.name =  2\n"), "a.b       = 1\nlong.name = 2\n");
}

TEST_F(Formatter, does_not_let_a_very_long_word_push_its_neighbours) {
    const std::string name(80, 'n');
    EXPECT_EQ(formatted("setp " + name + " 1\nsetp a 2\n"), "setp " + name + " 1\nsetp a 2\n");
}

TEST_F(Formatter, counts_characters_not_bytes) {
    EXPECT_EQ(formatted("setp größe 1\nsetp laenge 2\n"), "setp größe  1\nsetp laenge 2\n");
}

TEST_F(Formatter, writes_plain_line_ends) {
    EXPECT_EQ(formatted("start\r\n# c\r\nstop\r\n"), "start\n# c\nstop\n");
}

TEST_F(Formatter, drops_a_byte_order_mark_at_the_start_only) {
    EXPECT_EQ(formatted("\xEF\xBB\xBFstart\n"), "start\n");
    EXPECT_EQ(formatted("\n\xEF\xBB\xBFstart\n"), "\n\xEF\xBB\xBFstart\n");
}

TEST_F(Formatter, keeps_comments_that_go_on_in_the_next_line) {
    EXPECT_EQ(formatted("start # a \\\n   b  \nstop\n# c \\\n\nshow"),
              "start  # a \\\n   b\nstop\n# c\nshow\n");
}

TEST_F(Formatter, never_makes_a_backslash_join_lines) {
    EXPECT_EQ(formatted("net a\\ \nstop\n# b\\ \t\nstop\n# c \\"),
              "net a\\ \nstop\n# b\\ \nstop\n# c\n");
}

TEST_F(Formatter, leaves_a_faulty_text_as_it_is_and_says_why) {
    const std::string text = "setp   a   1\nprint \"\nsetp [X 1\n";
    EXPECT_EQ(hal::format(sources, add(text), found), text);
    EXPECT_EQ(render(found, sources),
              R"(test.hal:2:7: error: the quote " is never closed [unterminated-quote]
    2 | print "
      |       ^ opened here
      = help: close it with " on the same line; there is no escape character, but one kind of quote may appear inside the other

test.hal:3:6: error: '[' does not begin a valid [SECTION]KEY [bad-reference]
    3 | setp [X 1
      |      ^
      = help: write [SECTION]KEY or [SECTION](KEY) for a value of the INI file, or [0..5] for a range of names
)");
}

TEST_F(Formatter, needs_no_values_of_references) {
    EXPECT_EQ(formatted("setp  a $NOT_SET\nsetp b  [NO]KEY\n"),
              "setp a $NOT_SET\nsetp b [NO]KEY\n");
}

}  // namespace
