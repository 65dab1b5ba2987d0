// SPDX-License-Identifier: MIT
// The small functions of runtime/text: whole numbers, characters of names, counts and lists.
#include <cstdint>
#include <gtest/gtest.h>
#include <string>

#include "text/characters.hpp"
#include "text/numbers.hpp"
#include "text/quoting.hpp"

using namespace hal;

TEST(ParseWhole, accepts_a_text_that_is_one_number_and_nothing_else) {
    int number = 7;
    EXPECT_TRUE(parse_whole("-42", number));
    EXPECT_EQ(number, -42);
    for (const char* text : {"", " 1", "1 ", "+1", "1x", "0x1", "-", "99999999999"}) {
        EXPECT_FALSE(parse_whole(text, number)) << text;
        EXPECT_EQ(number, -42) << text;
    }
}

TEST(ParseWhole, reads_hexadecimal_digits_and_rejects_what_the_type_cannot_hold) {
    std::uint8_t byte = 0;
    EXPECT_TRUE(parse_whole("fE", byte, 16));
    EXPECT_EQ(byte, 0xfe);
    EXPECT_FALSE(parse_whole("100", byte, 16));
    EXPECT_FALSE(parse_whole("-1", byte, 16));
    EXPECT_EQ(byte, 0xfe);
}

TEST(ParseWhole, reads_real_numbers) {
    double number = 1.0;
    EXPECT_TRUE(parse_whole("-2.5e3", number));
    EXPECT_EQ(number, -2500.0);
    EXPECT_FALSE(parse_whole("2.5mm", number));
    EXPECT_EQ(number, -2500.0);
}

TEST(RemoveHexPrefix, leaves_a_prefix_without_digits) {
    for (const char* text : {"0x1F", "0X1F"}) {
        std::string_view digits = text;
        EXPECT_TRUE(remove_hex_prefix(digits));
        EXPECT_EQ(digits, "1F");
    }
    for (const std::string_view text : {"", "0", "0x", "1F", "x1"}) {
        std::string_view digits = text;
        EXPECT_FALSE(remove_hex_prefix(digits)) << text;
        EXPECT_EQ(digits, text);
    }
}

TEST(Characters, know_every_byte) {
    const std::string letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz";
    const std::string digits = "0123456789";
    for (int code = 0; code < 256; ++code) {
        const char c = static_cast<char>(code);
        const bool letter = letters.find(c) != std::string::npos;
        const bool digit = digits.find(c) != std::string::npos;
        EXPECT_EQ(is_letter(c), letter) << code;
        EXPECT_EQ(is_digit(c), digit) << code;
        EXPECT_EQ(is_alphanumeric(c), letter || digit) << code;
        EXPECT_EQ(is_name_character(c), letter || digit || c == '.' || c == '-' || c == '_')
            << code;
        EXPECT_EQ(upper(lower(c)), upper(c)) << code;
        const auto hex = std::string("0123456789abcdef").find(lower(c));
        EXPECT_EQ(hex_digit(c), hex == std::string::npos ? -1 : static_cast<int>(hex)) << code;
    }
}

TEST(Counted, has_the_plural_for_all_numbers_but_one) {
    EXPECT_EQ(counted(0, "frame"), "0 frames");
    EXPECT_EQ(counted(1u, "frame"), "1 frame");
    EXPECT_EQ(counted(std::uint8_t{2}, "frame"), "2 frames");
    EXPECT_EQ(counted(1, "entry", "entries"), "1 entry");
    EXPECT_EQ(counted(-1, "entry", "entries"), "-1 entries");
}

TEST(AppendItem, separates_items_but_does_not_begin_with_a_separator) {
    std::string list;
    append_item(list, "a");
    EXPECT_EQ(list, "a");
    append_item(list, "b");
    append_item(list, "c", "; ");
    EXPECT_EQ(list, "a, b; c");
}
