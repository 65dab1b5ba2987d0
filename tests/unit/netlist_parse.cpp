// SPDX-License-Identifier: MIT
#include "tests/unit/netlist_text.hpp"

namespace {

class Parser : public netlist_text::Netlist {};

TEST_F(Parser, splits_commands_at_blanks_and_lines) {
    EXPECT_EQ(words("loadrt and2 count=2\n\n  \t net  a\tx.out   => y.in \nstart"),
              R"(<loadrt> <and2> <count=2>
<net> <a> <x.out> <=>> <y.in>
<start>
)");
}

TEST_F(Parser, gives_nothing_for_an_empty_text) {
    EXPECT_EQ(words(""), "");
    EXPECT_EQ(words("\n\n"), "");
    EXPECT_EQ(words("# only a comment"), "");
}

TEST_F(Parser, skips_a_byte_order_mark) { EXPECT_EQ(words("\xEF\xBB\xBFstart\n"), "<start>\n"); }

TEST_F(Parser, cuts_comments_outside_quotes) {
    EXPECT_EQ(words("setp a 1 # it's \"this\nsetp b#c 2\nprint '#1' # x\n"),
              "<setp> <a> <1>\n<setp> <b>\n<print> <'#1'>\n");
}

TEST_F(Parser, keeps_quotes_in_the_word_and_blanks_between_them) {
    EXPECT_EQ(words("loadrt hostmot2 config=\"a  b\" x='\"' y=\"it's\""),
              "<loadrt> <hostmot2> <config=\"a  b\"> <x='\"'> <y=\"it's\">\n");
}

TEST_F(Parser, joins_lines_at_a_backslash) {
    EXPECT_EQ(words("net a \\\n  b \\\n\tc\nstart\n"), "<net> <a> <b> <c>\n<start>\n");
    EXPECT_EQ(words("ne\\\nt a \"b\\\n c\"\n"), "<net> <a> <\"b c\">\n");
    EXPECT_EQ(words("net a \\"), "<net> <a>\n");
    EXPECT_EQ(words("net a\\ \nb\n"), "<net> <a\\>\n<b>\n");
}

TEST_F(Parser, knows_where_each_word_stands) {
    const auto commands = parse("# first\n  net sig \\\n    pin.out $A\"x y\"  # end\n");
    ASSERT_EQ(commands.size(), 1u);
    EXPECT_EQ(in_source(commands[0].name.span), "net");
    EXPECT_EQ(in_source(commands[0].args[0].span), "sig");
    EXPECT_EQ(sources.location(commands[0].args[1].span), "test.hal:3:5");
    EXPECT_EQ(in_source(commands[0].args[1].span), "pin.out");
    EXPECT_EQ(commands[0].args[2].text, "alpha\"x y\"");
    EXPECT_EQ(in_source(commands[0].args[2].span), "$A\"x y\"");
    EXPECT_EQ(in_source(commands[0].span), "net sig \\\n    pin.out $A\"x y\"");
}

TEST_F(Parser, points_at_the_reference_of_each_word_of_a_value) {
    const auto commands = parse("setp x$(B).y z");
    ASSERT_EQ(commands.size(), 1u);
    ASSERT_EQ(netlist_text::joined(commands), "setp xtwo words.y z\n");
    EXPECT_EQ(in_source(commands[0].args[0].span), "x$(B)");
    EXPECT_EQ(in_source(commands[0].args[1].span), "$(B).y");
    EXPECT_EQ(in_source(commands[0].args[2].span), "z");
}

TEST_F(Parser, replaces_references_everywhere_but_in_comments) {
    environment.variable = [](const std::string& name) { return std::optional("<" + name + ">"); };
    EXPECT_EQ(words("setp $A-b.c_1 $(A b)x \"$A\" '$(B)' # $\n"),
              "<setp> <<A-b.c_1>> <<A> <b>x> <\"<A>\"> <'<B>'>\n");
}

TEST_F(Parser, splits_values_at_their_blanks) {
    EXPECT_EQ(words("setp $B \"$B\" x$(B)y $EMPTY z $QUOTED"),
              "<setp> <two> <words> <\"two words\"> <xtwo> <wordsy> <z> <\"one word\">\n");
    EXPECT_EQ(words("$EMPTY"), "");
}

TEST_F(Parser, takes_a_hash_in_a_value_as_a_character) {
    EXPECT_EQ(words("setp $HASH 1"), "<setp> <a#b> <1>\n");
}

TEST_F(Parser, does_not_look_into_values_for_references) {
    environment.variable = [](const std::string&) { return std::optional<std::string>("$A[X]Y"); };
    EXPECT_EQ(words("setp $A"), "<setp> <$A[X]Y>\n");
}

TEST_F(Parser, uses_the_process_environment_by_default) {
    environment.variable = nullptr;
    ::setenv("HALCYON_TEST_VALUE", "7", 1);
    EXPECT_EQ(words("setp a $HALCYON_TEST_VALUE"), "<setp> <a> <7>\n");
    EXPECT_EQ(
        said("setp a $HALCYON_TEST_VALU"),
        R"(test.hal:1:8: error: the environment variable 'HALCYON_TEST_VALU' is not set [unset-variable]
    1 | setp a $HALCYON_TEST_VALU
      |        ^^^^^^^^^^^^^^^^^^ did you mean 'HALCYON_TEST_VALUE'?
      = help: set it before the command: HALCYON_TEST_VALU=… hal …
)");
}

TEST_F(Parser, leaves_ranges_and_sets_alone) {
    EXPECT_EQ(words("net j[0..5]cmd {x,y}[00..11]"), "<net> <j[0..5]cmd> <{x,y}[00..11]>\n");
}

TEST_F(Parser, takes_a_bracket_in_show_and_list_as_part_of_a_pattern) {
    EXPECT_EQ(words("show pin pid.[01].* [\nlist pin [a-z](x)"),
              "<show> <pin> <pid.[01].*> <[>\n<list> <pin> <[a-z](x)>\n");
}

TEST_F(Parser, accepts_dos_line_ends_with_one_warning) {
    EXPECT_EQ(netlist_text::joined(parse("start\r\nnet a \\\r\n b\r\nstop\r\n")),
              "start\nnet a b\nstop\n");
    EXPECT_EQ(
        render(found, sources),
        R"(test.hal:1:6: warning: the lines of this file end in CR LF (DOS line endings) [dos-line-endings]
    1 | start
      |      ^
      = help: harmless here; `hal fmt` converts them to LF
)");
}

TEST_F(Parser, refuses_a_carriage_return_inside_a_line_once_per_file) {
    EXPECT_EQ(netlist_text::joined(parse("start\rstop\nnet a b\nshow\r")), "net a b\n");
    EXPECT_EQ(render(found, sources),
              R"(test.hal:1:6: error: carriage return without a line feed [lone-carriage-return]
    1 | start\x0dstop
      |      ^^^^
      = help: end lines with LF (or CR LF); `tr '\r' '\n'` converts a file with CR line endings
)");
}

TEST_F(Parser, refuses_an_open_quote_and_goes_on_with_the_next_line) {
    EXPECT_EQ(netlist_text::joined(parse("print \"it's\nsetp x 'y' z'\nstart\n")), "start\n");
    EXPECT_EQ(render(found, sources),
              R"(test.hal:1:7: error: the quote " is never closed [unterminated-quote]
    1 | print "it's
      |       ^ opened here
      = help: close it with " on the same line; there is no escape character, but one kind of quote may appear inside the other

test.hal:2:13: error: the quote ' is never closed [unterminated-quote]
    2 | setp x 'y' z'
      |             ^ opened here
      = help: close it with ' on the same line; there is no escape character, but one kind of quote may appear inside the other
)");
}

TEST_F(Parser, refuses_a_value_that_leaves_a_quote_open) {
    EXPECT_EQ(said("setp x $HALF"),
              R"(test.hal:1:8: error: the quote " is never closed [unterminated-quote]
    1 | setp x $HALF
      |        ^^^^^ it comes from this value
      = help: close it with " on the same line; there is no escape character, but one kind of quote may appear inside the other
)");
}

TEST_F(Parser, refuses_unset_variables_all_at_once) {
    EXPECT_EQ(said("setp $X $A\nsetp a $Y b $(Z z)\n"),
              R"(test.hal:1:6: error: the environment variable 'X' is not set [unset-variable]
    1 | setp $X $A
      |      ^^
      = help: set it before the command: X=… hal …

test.hal:2:8: error: the environment variable 'Y' is not set [unset-variable]
    2 | setp a $Y b $(Z z)
      |        ^^
      = help: set it before the command: Y=… hal …

test.hal:2:13: error: the environment variable 'Z z' is not set [unset-variable]
    2 | setp a $Y b $(Z z)
      |             ^^^^^^
      = help: set it before the command: env 'Z z=…' hal …
)");
}

TEST_F(Parser, refuses_references_without_a_name_or_an_end) {
    EXPECT_EQ(
        said("setp $ 1\nsetp $(A 1\nsetp [X 1\nsetp [X] 1\nsetp [X](Y 1\nsetp a[0..3 1\n"),
        R"(test.hal:1:6: error: missing name of an environment variable after '$' [bad-reference]
    1 | setp $ 1
      |      ^
      = help: write $NAME or $(NAME)

test.hal:2:6: error: missing name of an environment variable after '$' [bad-reference]
    2 | setp $(A 1
      |      ^^^^^
      = help: write $NAME or $(NAME)

test.hal:3:6: error: '[' does not begin a valid [SECTION]KEY [bad-reference]
    3 | setp [X 1
      |      ^
      = help: write [SECTION]KEY or [SECTION](KEY) for a value of the INI file, or [0..5] for a range of names

test.hal:4:6: error: '[' does not begin a valid [SECTION]KEY [bad-reference]
    4 | setp [X] 1
      |      ^^^
      = help: write [SECTION]KEY or [SECTION](KEY) for a value of the INI file, or [0..5] for a range of names

test.hal:5:6: error: '[' does not begin a valid [SECTION]KEY [bad-reference]
    5 | setp [X](Y 1
      |      ^^^^^^^
      = help: write [SECTION]KEY or [SECTION](KEY) for a value of the INI file, or [0..5] for a range of names

test.hal:6:7: error: missing ] of this range [bad-range]
    6 | setp a[0..3 1
      |       ^
      = help: write a range as [0..5], without spaces
)");
}

TEST_F(Parser, gives_up_on_a_binary_file_with_one_error) {
    const std::string binary("start\nnet a\0b\n\0\0\0\x01\n'\n", 20);
    EXPECT_EQ(netlist_text::joined(parse(binary)), "");
    EXPECT_EQ(render(found, sources), R"(test.hal:2:6: error: this is not a text file [binary-text]
    2 | net a\x00b
      |      ^^^^ a control character
      = help: a netlist is plain text in UTF-8; the whole file was ignored
)");
    found.clear();
    EXPECT_EQ(netlist_text::joined(parse("start\nnet \x1b[1m\n")), "");
    EXPECT_EQ(found.errors(), 1u);
}

TEST_F(Parser, accepts_any_bytes_but_zero_in_comments_and_8_bit_names) {
    EXPECT_EQ(words("# \x1b \x07\nsetp gr\xf6\xdf.in 1\n"), "<setp> <gr\xf6\xdf.in> <1>\n");
}

TEST_F(Parser, warns_of_a_comment_that_swallows_the_next_line) {
    EXPECT_EQ(netlist_text::joined(parse("start # C:\\\nstop\nshow\n")), "start\nshow\n");
    EXPECT_EQ(
        render(found, sources),
        R"(test.hal:1:7: warning: this comment ends in \ and therefore includes the next line, which is not executed [continued-comment]
    1 | start # C:\
      |       ^
      = help: remove the \, or move the comment to the end of the last line
)");
}

TEST_F(Parser, shows_20_errors_and_counts_the_others) {
    std::string text;
    for (int i = 0; i < 1000; ++i) {
        text += "print '\nsetp $NO 1\n";
    }
    parse(text);
    EXPECT_EQ(found.errors(), 21u);
    EXPECT_EQ(
        render(found.all().back(), sources),
        R"(test.hal:2000:6: error: 1980 more errors in this file are not shown [too-many-errors]
 2000 | setp $NO 1
      |      ^^^ the last of them
)");
}

TEST_F(Parser, bounds_what_references_become) {
    std::string text = "setp";
    for (int i = 0; i < 33; ++i) {
        text += " $LONG";
    }
    EXPECT_EQ(netlist_text::joined(parse(text + "\nstart\n")), "start\n");
    ASSERT_EQ(found.errors(), 1u);
    EXPECT_EQ(found.all()[0].message,
              "the values that replace references in this file exceed 32 MB in total");
}

TEST_F(Parser, has_no_small_limits) {
    std::string text = "net " + std::string(10'000, 'n');
    for (int i = 0; i < 100'000; ++i) {
        text += " pin" + std::to_string(i);
    }
    const auto commands = parse(text);
    ASSERT_EQ(commands.size(), 1u);
    EXPECT_EQ(commands[0].args.size(), 100'001u);
    EXPECT_EQ(commands[0].args[0].text.size(), 10'000u);
    EXPECT_EQ(commands[0].args.back().text, "pin99999");
}

// Each of these took minutes in a parser that looks ahead from every character.
TEST_F(Parser, takes_time_in_proportion_to_the_text) {
    constexpr std::size_t size = 500'000;
    const auto repeat = [](std::string_view part) {
        std::string text;
        while (text.size() < size) {
            text += part;
        }
        return text;
    };
    for (const char* part : {"[", "$", "$(", "[A](", "[0..", "\"", "' \"", "\\\n", "a\\\n", "[A",
                             "]", "{", "$A ", "#"}) {
        hal::Diagnostics local;
        hal::parse(sources, add(repeat(part)), environment, local);
        hal::format(sources, add(repeat(part)), local);
        EXPECT_LE(local.errors(), 42u) << part;
    }
}

TEST(Arrow, is_one_of_three_words) {
    for (const char* word : {"=>", "<=", "<=>"}) {
        EXPECT_TRUE(hal::is_arrow(word));
    }
    for (const char* word : {"==>", "<==", "=", "", "x=>y"}) {
        EXPECT_FALSE(hal::is_arrow(word));
    }
}

}  // namespace
