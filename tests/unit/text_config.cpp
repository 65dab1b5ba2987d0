// SPDX-License-Identifier: MIT
#include "text/config_text.hpp"

#include <gtest/gtest.h>

#include "text/characters.hpp"
#include "text/numbers.hpp"

namespace {

using namespace hal::text;

TEST(ConfigLines, have_no_comments_blanks_or_empty_lines) {
    Lines lines("\xef\xbb\xbf# first\n\n  a = 1  # one\r\n; second\nb=2#3;4 ;five");
    const auto a = lines.next();
    const auto b = lines.next();
    ASSERT_TRUE(a && b);
    EXPECT_EQ(a->text, "a = 1");
    EXPECT_EQ(a->at.line, 3u);
    EXPECT_EQ(a->at.column, 3u);
    EXPECT_EQ(b->text, "b=2#3;4");
    EXPECT_EQ(b->at.line, 5u);
    EXPECT_FALSE(lines.next());
}

TEST(ConfigWords, point_at_characters_and_bytes_of_the_file) {
    const std::string file = "\n ä,  b c";
    const auto words = words_of(*Lines(file).next(), ",");
    ASSERT_EQ(words.size(), 3u);
    EXPECT_EQ(words[1].text, "b");
    EXPECT_EQ(words[1].at.line, 2u);
    EXPECT_EQ(words[1].at.column, 6u);
    EXPECT_EQ(file.substr(words[1].at.offset, words[1].at.length), "b");
    EXPECT_EQ(list_of({"a,,b ", {}}).size(), 3u);
}

TEST(ConfigMessages, keep_a_hundred_errors_and_one_more) {
    Messages<int> messages;
    for (int i = 0; i < 1000; ++i) {
        messages.error(0, {}, "wrong");
    }
    messages.note(0, {}, "still kept");
    EXPECT_EQ(messages.all.size(), max_errors + 2);
    EXPECT_TRUE(messages.failed());
}

TEST(ConfigMessages, are_sorted_by_place_and_not_repeated) {
    std::vector<Message<int>> messages;
    for (const char* sentence : {"b", "a", "b"}) {
        messages.push_back({hal::Severity::error, 0, {2, 1, 9, 1}, sentence});
    }
    messages.push_back({hal::Severity::warning, 0, {1, 4, 3, 1}, "c", "write d"});
    sort(messages);
    ASSERT_EQ(messages.size(), 3u);
    EXPECT_EQ(messages[0].sentence + messages[1].sentence + messages[2].sentence, "cba");
    EXPECT_EQ(errors_text(messages, "f"), "f:2:1: error: b\nf:2:1: error: a");
    EXPECT_EQ(message_text("f", hal::Severity::warning, messages[0].at, "c", "write d"),
              "f:1:4: warning: c; write d");
}

TEST(IniLine, is_a_section_an_entry_a_comment_or_something_else) {
    using Kind = IniLine::Kind;
    EXPECT_EQ(ini_line(" \t\r").kind, Kind::empty);
    EXPECT_EQ(ini_line(" ; a = b").kind, Kind::comment);
    EXPECT_EQ(ini_line("=b").kind, Kind::other);
    EXPECT_EQ(ini_line("ab").kind, Kind::other);
    EXPECT_EQ(ini_line("[A").kind, Kind::open_section);
    EXPECT_EQ(ini_line("[A").name, "A");
    EXPECT_EQ(ini_line(" [A B] x ").name, "A B");
    EXPECT_EQ(ini_line(" [A B] x ").value, "x");
    EXPECT_EQ(ini_line(" a b = c = d\r").name, "a b");
    EXPECT_EQ(ini_line(" a b = c = d\r").value, "c = d");
    EXPECT_EQ(ini_line("a=").kind, Kind::entry);
}

TEST(Numbers, are_read_whole_or_not_at_all) {
    EXPECT_EQ(hal::parse_natural("0x1F"), 31u);
    EXPECT_EQ(hal::parse_natural("010"), 10u);
    for (const char* text : {"", "0x", "-1", "1.5", "1 ", "99999999999999999999"}) {
        EXPECT_EQ(hal::parse_natural(text), std::nullopt) << text;
    }
    EXPECT_EQ(hal::parse_real("-2e-3"), -2e-3);
    EXPECT_EQ(hal::parse_real("+1.5"), 1.5);
    for (const char* text : {"", "1,5", "1x", "1 ", "inf", "nan", "+-1", "1e999"}) {
        EXPECT_EQ(hal::parse_real(text), std::nullopt) << text;
    }
    const auto rate = hal::parse_quantity("500 k");
    ASSERT_TRUE(rate);
    EXPECT_EQ(rate->number, 500.0);
    EXPECT_EQ(rate->unit, "k");
}

TEST(Characters, make_names_without_a_locale) {
    EXPECT_EQ(hal::dashed(" Position actual_value (1) "), "position-actual-value-1");
    EXPECT_TRUE(hal::same_word("AbC", "aBc"));
    EXPECT_EQ(hal::trimmed(" \ta b\r\n"), "a b");
    EXPECT_EQ(hal::characters("aäb"), 3u);
}

}  // namespace
