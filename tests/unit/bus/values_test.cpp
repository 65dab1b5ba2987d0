// SPDX-License-Identifier: MIT
// Values of CiA 301 in bytes, and the search for the text of a value.
#include "cia301/values.hpp"

#include <array>
#include <cmath>

#include "text/text_table.hpp"

namespace {

using namespace hal::cia301;
using Bytes = std::array<std::uint8_t, 9>;

TEST(Values, Natural_numbers_are_little_endian_and_at_most_eight_bytes) {
    const Bytes bytes{1, 2, 0, 0, 0, 0, 0, 0x80, 0xff};
    const std::span<const std::uint8_t> all(bytes);
    EXPECT_EQ(0U, natural_of(all.first(0)));
    EXPECT_EQ(1U, natural_of(all.first(1)));
    EXPECT_EQ(0x201U, natural_of(all.first(3)));
    EXPECT_EQ(0x8000'0000'0000'0201U, natural_of(all));
}

TEST(Values, Sign_is_that_of_the_highest_bit_of_the_width) {
    EXPECT_EQ(-1, sign_extended(1, 1));
    EXPECT_EQ(-1, sign_extended(0xff, 8));
    EXPECT_EQ(0x7f, sign_extended(0xf7f, 8));
    EXPECT_EQ(INT64_MIN, sign_extended(0x8000'0000'0000'0000U, 64));
}

TEST(Values, Reals_have_32_or_64_bits) {
    EXPECT_EQ(-1.5, real_of(std::bit_cast<std::uint32_t>(-1.5F), 32));
    EXPECT_EQ(0.1, real_of(std::bit_cast<std::uint64_t>(0.1), 64));
    EXPECT_TRUE(std::isnan(real_of(0x7fc00000, 32)));
}

TEST(Values, Integers_have_the_sign_of_their_type) {
    const Bytes bytes{0xfe, 0xff, 0xff, 0xff};
    const std::span<const std::uint8_t> four = std::span(bytes).first(4);
    EXPECT_EQ(-2, integer_of(Type::integer32, four));
    EXPECT_EQ(0xffff'fffe, integer_of(Type::unsigned32, four));
    EXPECT_EQ(-2, integer_of(Type::integer8, four.first(1)));
}

TEST(TextTable, A_value_without_a_row_has_the_other_text) {
    constexpr hal::TextRow<int> rows[] = {{1, "one"}, {3, "three"}};
    static_assert(hal::find_text(rows, 9, nullptr) == nullptr);
    EXPECT_STREQ("three", hal::find_text(rows, 3, "?"));
    EXPECT_STREQ("?", hal::find_text(rows, 2, "?"));
}

}  // namespace
