// SPDX-License-Identifier: MIT
#include "text/diagnostic.hpp"

#include <gtest/gtest.h>

#include "text/glyphs.hpp"

namespace {

using hal::Diagnostic;
using hal::Diagnostics;
using hal::Severity;
using hal::Sources;
using hal::Span;

/// The place of `word` in a source.
Span find(const Sources& sources, std::uint32_t source, std::string_view word) {
    const auto at = sources.get(source).text.find(word);
    EXPECT_NE(at, std::string::npos) << word;
    return {source, static_cast<std::uint32_t>(at), static_cast<std::uint32_t>(at + word.size())};
}

class Rendering : public testing::Test {
protected:
    std::uint32_t add(std::string text) { return sources.add("test.hal", std::move(text)); }
    /// The error at `word` of the source `text`, as it is printed.
    std::string at(std::string text, std::string_view word, std::string label = "here") {
        const std::uint32_t source = add(std::move(text));
        Diagnostics found;
        found.error("two-writers", find(sources, source, word), "wrong", std::move(label));
        return render(found, sources);
    }
    Sources sources;
};

TEST_F(Rendering, shows_two_places_on_two_lines) {
    const auto source =
        add("net effort     pos.output   => motor.value\nnet effort     trim.out\n");
    Diagnostic error{.code = "two-writers", .message = "signal 'effort' already has a writer"};
    error.labels = {{find(sources, source, "trim.out"), "second output"},
                    {find(sources, source, "pos.output"), "first output"}};
    error.help = {"a signal has one output pin; join two sources with sum2, or2 or mux2"};
    EXPECT_EQ(render(error, sources),
              R"(test.hal:2:16: error: signal 'effort' already has a writer [two-writers]
    2 | net effort     trim.out
      |                ^^^^^^^^ second output
    1 | net effort     pos.output   => motor.value
      |                ---------- first output
      = help: a signal has one output pin; join two sources with sum2, or2 or mux2
)");
}

TEST_F(Rendering, shows_two_places_on_one_line) {
    const auto source = add("net arm-count  arm.count    => pos.command");
    Diagnostic warning{
        .severity = Severity::warning, .code = "two-writers", .message = "types differ"};
    warning.labels = {{find(sources, source, "pos.command"), "float"},
                      {find(sources, source, "arm.count"), "the signal became s32 here"}};
    EXPECT_EQ(render(warning, sources), R"(test.hal:1:32: warning: types differ [two-writers]
    1 | net arm-count  arm.count    => pos.command
      |                ---------       ^^^^^^^^^^^ float
      |                the signal became s32 here
)");
}

TEST_F(Rendering, puts_the_main_place_above_when_places_overlap) {
    const auto source = add("abcdef");
    Diagnostic error{.code = "two-writers", .message = "wrong"};
    error.labels = {{find(sources, source, "cd"), "inner"},
                    {find(sources, source, "abcdef"), "outer"}};
    EXPECT_EQ(render(error, sources), R"(test.hal:1:3: error: wrong [two-writers]
    1 | abcdef
      | --^^-- outer
      |   inner
)");
}

TEST_F(Rendering, names_the_file_of_a_place_in_another_file) {
    const auto source = add("net x y\n");
    const auto other = sources.add("other.hal", "# first\nnet x z\n");
    Diagnostic error{.code = "two-writers", .message = "wrong"};
    error.labels = {{find(sources, source, "y"), "second"}, {find(sources, other, "z"), "first"}};
    EXPECT_EQ(render(error, sources), R"(test.hal:1:7: error: wrong [two-writers]
    1 | net x y
      |       ^ second
   in other.hal:2:7
    2 | net x z
      |       - first
)");
}

TEST_F(Rendering, points_behind_the_end_of_a_line_and_of_the_file) {
    const auto source = add("abc\n");
    Diagnostics found;
    found.error("two-writers", {source, 3, 3}, "no value");
    found.error("two-writers", {source, 4, 4}, "no line");
    EXPECT_EQ(render(found, sources), R"(test.hal:1:4: error: no value [two-writers]
    1 | abc
      |    ^

test.hal:2:1: error: no line [two-writers]
    2 |
      | ^
)");
}

TEST_F(Rendering, underlines_the_first_line_of_a_place_on_several) {
    EXPECT_EQ(at("net a \\\n b\n", "a \\\n b"),
              "test.hal:1:5: error: wrong [two-writers]\n    1 | net a \\\n      |     ^^^ here\n");
}

TEST_F(Rendering, keeps_carets_below_tabs_and_wide_characters) {
    EXPECT_EQ(at("net\tä日本\tx end", "end"),
              "test.hal:1:11: error: wrong [two-writers]\n"
              "    1 | net     ä日本   x end\n"
              "      |                   ^^^ here\n");
}

TEST_F(Rendering, shows_control_characters_and_broken_bytes_as_escapes) {
    EXPECT_EQ(at("a\x1b[31m\xff\x01 end", "end"),
              "test.hal:1:10: error: wrong [two-writers]\n"
              "    1 | a\\x1b[31m\\xff\\x01 end\n"
              "      |                   ^^^ here\n");
    EXPECT_EQ(at("\u202Ereversed end", "end"),
              "test.hal:1:11: error: wrong [two-writers]\n"
              "    1 | \\xe2\\x80\\xaereversed end\n"
              "      |                      ^^^ here\n");
}

TEST_F(Rendering, does_not_count_a_byte_order_mark) {
    EXPECT_EQ(
        at("\xEF\xBB\xBFstart bad\n", "bad"),
        "test.hal:1:7: error: wrong [two-writers]\n    1 | start bad\n      |       ^^^ here\n");
}

TEST_F(Rendering, windows_a_huge_line_around_the_place) {
    const std::string text = std::string(1'000'000, 'a') + " bad " + std::string(1'000'000, 'c');
    EXPECT_EQ(at(text, "bad"), "test.hal:1:1000002: error: wrong [two-writers]\n    1 | …" +
                                   std::string(39, 'a') + " bad " + std::string(55, 'c') +
                                   "…\n      | " + std::string(41, ' ') + "^^^ here\n");
}

TEST_F(Rendering, shows_two_places_far_apart_on_one_line_in_two_windows) {
    const auto source = add("first " + std::string(1000, 'a') + " last");
    Diagnostic error{.code = "two-writers", .message = "wrong"};
    error.labels = {{find(sources, source, "last"), "L"}, {find(sources, source, "first"), "F"}};
    EXPECT_EQ(render(error, sources),
              "test.hal:1:1008: error: wrong [two-writers]\n"
              "    1 | …" +
                  std::string(39, 'a') + " last\n      | " + std::string(41, ' ') + "^^^^ L\n" +
                  "    1 | first " + std::string(94, 'a') + "…\n      | ----- F\n");
}

TEST_F(Rendering, is_bounded_when_the_line_has_no_width_or_nothing_but_escapes) {
    std::string combining = "x";
    for (int i = 0; i < 100'000; ++i) {
        combining += "\u0301";
    }
    EXPECT_LT(at(combining + "end", "end").size(), 5000u);
    EXPECT_LT(at(std::string(100'000, '\x01') + "end", "end").size(), 5000u);
    EXPECT_LT(at(std::string(100'000, '\t') + "end", "end").size(), 5000u);
    EXPECT_LT(at(std::string(90, '\t') + "end", "end").size(), 5000u);
    EXPECT_LT(at(std::string(100'000, '\x80') + "end", "end").size(), 5000u);
    EXPECT_LT(at(std::string(90, '\r') + "end", "end").size(), 5000u);
}

TEST_F(Rendering, shortens_a_name_of_10000_characters) {
    const auto source = add("x");
    Diagnostics found;
    found.error("two-writers", find(sources, source, "x"),
                "unknown pin '" + std::string(10'000, 'n') + "'");
    EXPECT_EQ(render(found, sources), "test.hal:1:1: error: unknown pin '" + std::string(132, 'n') +
                                          "…" + std::string(49, 'n') +
                                          "' [two-writers]\n    1 | x\n      | ^\n");
}

TEST_F(Rendering, keeps_a_message_on_one_line) {
    const auto source = add("x");
    Diagnostics found;
    found.error("two-writers", find(sources, source, "x"), "one\ntwo\x1b", "la\tbel",
                "first\nsecond");
    EXPECT_EQ(render(found, sources),
              "test.hal:1:1: error: one two\\x1b [two-writers]\n    1 | x\n      | ^ la bel\n"
              "      = help: first\n              second\n");
}

TEST_F(Rendering, needs_no_place) {
    Diagnostics found;
    found.error("two-writers", {}, "wrong", "label", "do this");
    EXPECT_EQ(render(found, sources),
              "error: wrong [two-writers]\n      = note: label\n      = help: do this\n");
    EXPECT_EQ(render(Diagnostic{.code = "two-writers", .message = "wrong"}, sources),
              "error: wrong [two-writers]\n");
}

TEST_F(Rendering, makes_room_for_long_line_numbers) {
    EXPECT_EQ(
        at(std::string(1'234'567, '\n') + "word\n", "word"),
        "test.hal:1234568:1: error: wrong [two-writers]\n1234568 | word\n        | ^^^^ here\n");
}

TEST_F(Rendering, colors_when_asked) {
    const auto source = add("bad");
    EXPECT_EQ(render(Diagnostic{.code = "two-writers",
                                .message = "wrong",
                                .labels = {{find(sources, source, "bad"), "here"}}},
                     sources, true),
              "test.hal:1:1: \033[1;31merror: \033[0m\033[1mwrong\033[0m [two-writers]\n"
              "\033[34m    1 | \033[0mbad\n\033[34m      | \033[0m\033[1;31m^^^\033[0m "
              "\033[1;31mhere\033[0m\n");
}

TEST_F(Rendering, sorts_by_place_with_files_in_order_of_first_mention) {
    const auto first = sources.add("b.hal", "one two\n");
    const auto second = sources.add("a.hal", "three\n");
    Diagnostics found;
    found.error("two-writers", find(sources, first, "two"), "B");
    found.error("two-writers", find(sources, second, "three"), "C");
    found.note("two-writers", find(sources, first, "one"), "A");
    EXPECT_EQ(render(found, sources), R"(b.hal:1:1: note: A [two-writers]
    1 | one two
      | ^^^

b.hal:1:5: error: B [two-writers]
    1 | one two
      |     ^^^

a.hal:1:1: error: C [two-writers]
    1 | three
      | ^^^^^
)");
}

TEST(Diagnostics, counts_by_severity_and_moves_between_collections) {
    Diagnostics all, more;
    EXPECT_FALSE(all.failed());
    all.warning("two-writers", {}, "w");
    all.note("two-writers", {}, "n");
    EXPECT_FALSE(all.failed());
    more.error("two-writers", {}, "e");
    all.take(more);
    EXPECT_TRUE(all.failed());
    EXPECT_EQ(all.errors(), 1u);
    EXPECT_EQ(all.warnings(), 1u);
    EXPECT_EQ(all.notes(), 1u);
    EXPECT_TRUE(more.all().empty());
    EXPECT_FALSE(more.failed());
    all.clear();
    EXPECT_EQ(all.errors() + all.warnings() + all.notes(), 0u);
}

TEST(Suggestion, finds_what_was_mistyped) {
    EXPECT_EQ(hal::did_you_mean("a.ot", {"a.out", "a.in0", "a.in1"}), "did you mean 'a.out'?");
    EXPECT_EQ(
        hal::did_you_mean("pos.feedbck", {"pos.feedback", "pos.feedback-deriv", "neg.feedback"}),
        "did you mean 'pos.feedback'?");
    EXPECT_EQ(hal::did_you_mean("pos.fedeback", {"pos.feedback", "pos.output"}),
              "did you mean 'pos.feedback'?");
    EXPECT_EQ(hal::did_you_mean("PID_0_OUTPUT", {"pid.0.output", "pid.1.output"}),
              "did you mean 'pid.0.output'?");
}

TEST(Suggestion, names_those_that_are_equally_near) {
    EXPECT_EQ(hal::did_you_mean("ad2", {"and2", "add", "sub2"}), "did you mean 'add' or 'and2'?");
    EXPECT_EQ(hal::did_you_mean("x3", {"x0", "x1", "x2", "x4"}),
              "did you mean 'x0', 'x1' or 'x2'?");
}

TEST(Suggestion, completes_a_beginning) {
    EXPECT_EQ(hal::did_you_mean("servo", {"servo-thread", "base-thread"}),
              "did you mean 'servo-thread'?");
}

TEST(Suggestion, is_silent_when_nothing_is_near) {
    EXPECT_EQ(hal::did_you_mean("motor.speed", {"pid.0.output", "x"}), "");
    EXPECT_EQ(hal::did_you_mean("x", {"y", "z"}), "");
    EXPECT_EQ(hal::did_you_mean("", {"a"}), "");
    EXPECT_EQ(hal::did_you_mean(std::string(10'000, 'x'), {"a", "pid.0.output"}), "");
}

TEST(Suggestion, finds_a_slip_in_a_name_of_10000_characters) {
    const std::string right(10'000, 'x');
    std::string wrong = right;
    wrong[5000] = 'y';
    EXPECT_EQ(hal::similar(wrong, {right}), std::vector<std::string>{right});
}

TEST(List, is_cut_to_a_line) {
    EXPECT_EQ(hal::listed({}), "");
    EXPECT_EQ(hal::listed({"a", "b"}), "a, b");
    EXPECT_EQ(hal::listed({"a", "b", "c", "d"}, 2), "a, b, … (2 more)");
    EXPECT_EQ(hal::listed({std::string(150, 'a'), "b"}), std::string(150, 'a') + ", … (1 more)");
    EXPECT_EQ(hal::listed({"a"}, 0), "… (1 more)");
}

TEST(Columns, count_what_a_terminal_shows) {
    EXPECT_EQ(hal::columns("abc"), 3u);
    EXPECT_EQ(hal::columns("äöü"), 3u);
    EXPECT_EQ(hal::columns("日本"), 4u);
    EXPECT_EQ(hal::columns("e\u0301"), 1u);
    EXPECT_EQ(hal::columns("\x1b"), 4u);
    EXPECT_EQ(hal::columns("\xe2\x82"), 8u);  // a cut euro sign
}

TEST(Place, counts_lines_and_characters_from_one) {
    Sources sources;
    const auto source = sources.add("f.hal", "ab\näöü x\r\n\nlast");
    EXPECT_EQ(sources.location(find(sources, source, "ab")), "f.hal:1:1");
    EXPECT_EQ(sources.location(find(sources, source, "x")), "f.hal:2:5");
    EXPECT_EQ(sources.location(find(sources, source, "last"), false), "f.hal:4");
    EXPECT_EQ(sources.line(find(sources, source, "x")), "äöü x");
    EXPECT_EQ(sources.location({}), "<runtime>");
}

}  // namespace
