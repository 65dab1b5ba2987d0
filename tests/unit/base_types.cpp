// SPDX-License-Identifier: MIT
#include "base/types.hpp"

#include <gtest/gtest.h>

#include <clocale>
#include <cmath>
#include <limits>

namespace {

std::string problem(hal_type type, std::string_view text) {
    return hal::parse_value(type, text).problem;
}

hal_value good(hal_type type, std::string_view text) {
    const hal::Parsed parsed = hal::parse_value(type, text);
    EXPECT_EQ(parsed.problem, "") << text;
    return parsed.value;
}

hal_value real(double value) {
    hal_value made{};
    made.real = value;
    return made;
}

TEST(Types, are_found_by_the_names_of_both_dialects) {
    EXPECT_EQ(hal::type_named("bit"), HAL_TYPE_BIT);
    EXPECT_EQ(hal::type_named("bool"), HAL_TYPE_BIT);
    EXPECT_EQ(hal::type_named("real"), HAL_TYPE_FLOAT);
    EXPECT_EQ(hal::type_named("sint"), HAL_TYPE_S64);
    EXPECT_EQ(hal::type_named("u64"), HAL_TYPE_U64);
    EXPECT_EQ(hal::type_named("port"), HAL_TYPE_PORT);
    EXPECT_EQ(hal::type_named("BIT"), HAL_TYPE_BIT);
    EXPECT_EQ(hal::type_named("Float"), HAL_TYPE_FLOAT);
    EXPECT_EQ(hal::type_named(""), std::nullopt);
}

TEST(Bit_value, is_read_from_all_words_in_any_case) {
    for (const char* word : {"TRUE", "true", "True", "1", "yes", "ON"}) {
        EXPECT_TRUE(good(HAL_TYPE_BIT, word).bit) << word;
    }
    for (const char* word : {"FALSE", "false", "0", "No", "off"}) {
        EXPECT_FALSE(good(HAL_TYPE_BIT, word).bit) << word;
    }
}

TEST(Bit_value, says_what_is_allowed_when_the_word_is_none) {
    EXPECT_EQ(problem(HAL_TYPE_BIT, "2"), "'2' is not a bit (TRUE, FALSE, 1, 0, yes, no, on, off)");
    EXPECT_EQ(problem(HAL_TYPE_BIT, ""), "'' is not a bit (TRUE, FALSE, 1, 0, yes, no, on, off)");
    EXPECT_EQ(problem(HAL_TYPE_BIT, "truee"),
              "'truee' is not a bit (TRUE, FALSE, 1, 0, yes, no, on, off)");
}

TEST(Integer_value, is_read_in_base_10_16_and_8) {
    EXPECT_EQ(good(HAL_TYPE_S32, "-12").s32, -12);
    EXPECT_EQ(good(HAL_TYPE_S32, "+12").s32, 12);
    EXPECT_EQ(good(HAL_TYPE_S32, "0x7FFFFFFF").s32, 0x7FFFFFFF);
    EXPECT_EQ(good(HAL_TYPE_S32, "-0x10").s32, -16);
    EXPECT_EQ(good(HAL_TYPE_U32, "010").u32, 8u);
    EXPECT_EQ(good(HAL_TYPE_U32, "0").u32, 0u);
    EXPECT_EQ(good(HAL_TYPE_U32, "-0").u32, 0u);
}

TEST(Integer_value, reaches_both_ends_of_its_type) {
    EXPECT_EQ(good(HAL_TYPE_S32, "-2147483648").s32, std::numeric_limits<std::int32_t>::min());
    EXPECT_EQ(good(HAL_TYPE_S32, "2147483647").s32, std::numeric_limits<std::int32_t>::max());
    EXPECT_EQ(good(HAL_TYPE_U32, "4294967295").u32, std::numeric_limits<std::uint32_t>::max());
    EXPECT_EQ(good(HAL_TYPE_S64, "-9223372036854775808").s64,
              std::numeric_limits<std::int64_t>::min());
    EXPECT_EQ(good(HAL_TYPE_S64, "9223372036854775807").s64,
              std::numeric_limits<std::int64_t>::max());
    EXPECT_EQ(good(HAL_TYPE_U64, "18446744073709551615").u64,
              std::numeric_limits<std::uint64_t>::max());
}

TEST(Integer_value, is_refused_one_beyond_either_end) {
    EXPECT_EQ(problem(HAL_TYPE_S32, "3000000000"),
              "3000000000 is out of range for s32 (-2147483648 to 2147483647)");
    EXPECT_EQ(problem(HAL_TYPE_S32, "2147483648"),
              "2147483648 is out of range for s32 (-2147483648 to 2147483647)");
    EXPECT_EQ(problem(HAL_TYPE_S32, "-2147483649"),
              "-2147483649 is out of range for s32 (-2147483648 to 2147483647)");
    EXPECT_EQ(problem(HAL_TYPE_U32, "4294967296"),
              "4294967296 is out of range for u32 (0 to 4294967295)");
    EXPECT_EQ(problem(HAL_TYPE_U32, "-1"), "-1 is out of range for u32 (0 to 4294967295)");
    EXPECT_EQ(problem(HAL_TYPE_S64, "9223372036854775808"),
              "9223372036854775808 is out of range for s64 (-9223372036854775808 to "
              "9223372036854775807)");
    EXPECT_EQ(problem(HAL_TYPE_S64, "-9223372036854775809"),
              "-9223372036854775809 is out of range for s64 (-9223372036854775808 to "
              "9223372036854775807)");
    EXPECT_EQ(problem(HAL_TYPE_U64, "18446744073709551616"),
              "18446744073709551616 is out of range for u64 (0 to 18446744073709551615)");
}

TEST(Integer_value, is_refused_when_it_is_not_one) {
    EXPECT_EQ(problem(HAL_TYPE_S32, "1.5"), "'1.5' is not a whole number");
    EXPECT_EQ(problem(HAL_TYPE_S32, "08"), "'08' is not a whole number (a leading 0 means octal)");
    for (const char* text : {"", "-", "+", "0x", "--1", "+-1", "1 ", " 1", "12a", "0xg", "TRUE"}) {
        EXPECT_EQ(problem(HAL_TYPE_U64, text), "'" + std::string(text) + "' is not a whole number");
    }
}

TEST(Integer_value, in_a_record_has_leading_zeros_without_a_meaning) {
    for (const auto& [text, expected] :
         {std::pair("010", 10), std::pair("-08", -8), std::pair("0x10", 16)}) {
        EXPECT_EQ(hal::parse_value(HAL_TYPE_S32, text, hal::LeadingZero::decimal).value.s32,
                  expected)
            << text;
    }
}

TEST(Integer_value, of_setp_keeps_its_low_bits) {
    const auto s32 = [](const char* text) { return hal::parse_wrapping(HAL_TYPE_S32, text); };
    const auto u32 = [](const char* text) { return hal::parse_wrapping(HAL_TYPE_U32, text); };
    EXPECT_EQ(s32("0xFFFFFFFF").value.s32, -1);
    EXPECT_EQ(s32("0xFFFFFFFF").warning, "");
    EXPECT_EQ(s32("3000000000").value.s32, -1294967296);
    EXPECT_EQ(s32("3000000000").warning,
              "3000000000 is out of range for s32 (-2147483648 to 2147483647)");
    EXPECT_EQ(s32("-3000000000").value.s32, 1294967296);
    EXPECT_EQ(s32("0x1FFFFFFFF").value.s32, -1);
    EXPECT_NE(s32("0x1FFFFFFFF").warning, "");
    EXPECT_EQ(u32("-1").value.u32, 4294967295u);
    EXPECT_EQ(u32("-1").warning, "");
    EXPECT_EQ(u32("-4294967297").value.u32, 4294967295u);
    EXPECT_NE(u32("-4294967297").warning, "");
    EXPECT_EQ(u32("4294967296").value.u32, 0u);
    EXPECT_EQ(hal::parse_wrapping(HAL_TYPE_U64, "-1").value.u64,
              std::numeric_limits<std::uint64_t>::max());
    EXPECT_NE(hal::parse_wrapping(HAL_TYPE_S64, "9223372036854775808").problem, "");
    EXPECT_EQ(s32("99999999999999999999").problem,
              "99999999999999999999 is out of range for s32 (-2147483648 to 2147483647)");
    EXPECT_EQ(s32("1.5").problem, "'1.5' is not a whole number");
    EXPECT_EQ(hal::parse_wrapping(HAL_TYPE_BIT, "yes").problem, "");
}

TEST(Value, is_cut_in_a_message_when_it_is_a_book) {
    EXPECT_EQ(problem(HAL_TYPE_FLOAT, std::string(10000, 'x')),
              "'" + std::string(60, 'x') + "…' is not a number");
}

TEST(Float_value, is_read_as_strtod_reads_it_in_the_C_locale) {
    EXPECT_EQ(good(HAL_TYPE_FLOAT, "0.1").real, 0.1);
    EXPECT_EQ(good(HAL_TYPE_FLOAT, "-2e-3").real, -2e-3);
    EXPECT_EQ(good(HAL_TYPE_FLOAT, ".5").real, 0.5);
    EXPECT_EQ(good(HAL_TYPE_FLOAT, "5.").real, 5.0);
    EXPECT_EQ(good(HAL_TYPE_FLOAT, "+7").real, 7.0);
    EXPECT_EQ(good(HAL_TYPE_FLOAT, "0x1p3").real, 8.0);
    EXPECT_EQ(good(HAL_TYPE_FLOAT, "1e-400").real, 0.0);
    EXPECT_TRUE(std::isinf(good(HAL_TYPE_FLOAT, "-inf").real));
    EXPECT_TRUE(std::isnan(good(HAL_TYPE_FLOAT, "nan").real));
}

TEST(Float_value, does_not_depend_on_the_locale) {
    const std::string before = std::setlocale(LC_ALL, nullptr);
    for (const char* locale : {"de_DE.UTF-8", "fr_FR.UTF-8", "C.UTF-8"}) {
        std::setlocale(LC_ALL, locale);
    }
    EXPECT_EQ(good(HAL_TYPE_FLOAT, "1.5").real, 1.5);
    EXPECT_EQ(hal::format_value(HAL_TYPE_FLOAT, real(1.5)), "1.5");
    std::setlocale(LC_ALL, before.c_str());
}

TEST(Float_value, is_refused_when_it_is_none_or_too_large) {
    for (const char* text :
         {"", "-", "1,500", "1,5,5", ",5", "1,", " 1", "1 ", "1e", "abc", "0x", "1.5mm"}) {
        EXPECT_EQ(problem(HAL_TYPE_FLOAT, text), "'" + std::string(text) + "' is not a number");
    }
    EXPECT_EQ(problem(HAL_TYPE_FLOAT, "1,5"), "'1,5' is not a number; write 1.5");
    EXPECT_EQ(problem(HAL_TYPE_FLOAT, "-0,25"), "'-0,25' is not a number; write -0.25");
    EXPECT_EQ(problem(HAL_TYPE_FLOAT, std::string_view("1\0", 2)),
              std::string("'1\0' is not a number", 20));
    EXPECT_EQ(problem(HAL_TYPE_FLOAT, "1e999"),
              "1e999 is out of range for float (up to 1.797693e+308)");
    EXPECT_EQ(problem(HAL_TYPE_FLOAT, "-1e999"),
              "-1e999 is out of range for float (up to 1.797693e+308)");
}

TEST(Port_value, cannot_be_written) {
    EXPECT_EQ(problem(HAL_TYPE_PORT, "1"), "a port has no value to write");
}

TEST(Format, prints_values_as_getp_does) {
    EXPECT_EQ(hal::format_value(HAL_TYPE_BIT, good(HAL_TYPE_BIT, "1")), "TRUE");
    EXPECT_EQ(hal::format_value(HAL_TYPE_BIT, hal_value{}), "FALSE");
    EXPECT_EQ(hal::format_value(HAL_TYPE_S64, good(HAL_TYPE_S64, "-9223372036854775808")),
              "-9223372036854775808");
    EXPECT_EQ(hal::format_value(HAL_TYPE_FLOAT, real(123456789.0)), "1.234568e+08");
    EXPECT_EQ(hal::format_value(HAL_TYPE_FLOAT, real(0.1)), "0.1");
    EXPECT_EQ(hal::format_value(HAL_TYPE_FLOAT, real(-1e-5)), "-1e-05");
    EXPECT_EQ(hal::format_value(HAL_TYPE_FLOAT, real(std::numeric_limits<double>::infinity())),
              "inf");
}

TEST(Format, prints_the_size_of_a_port) {
    hal_value value{};
    EXPECT_EQ(hal::format_value(HAL_TYPE_PORT, value), "0");
    hal_port port{};
    port.capacity = 512;
    value.port = &port;
    EXPECT_EQ(hal::format_value(HAL_TYPE_PORT, value), "512");
}

TEST(Exact_format, gives_the_same_float_back) {
    for (const double value :
         {0.1, 1.0 / 3.0, 123456789.123, 5e-324, 1.7976931348623157e308, -0.0, 1e22, 65537.0}) {
        const double read =
            good(HAL_TYPE_FLOAT, hal::format_exact(HAL_TYPE_FLOAT, real(value))).real;
        EXPECT_EQ(read, value);
        EXPECT_EQ(std::signbit(read), std::signbit(value));
    }
    EXPECT_EQ(hal::format_exact(HAL_TYPE_FLOAT, real(0.1)), "0.1");
}

TEST(Duration, is_read_with_its_unit) {
    EXPECT_EQ(hal::parse_duration_ns("10s"), 10'000'000'000);
    EXPECT_EQ(hal::parse_duration_ns("250ms"), 250'000'000);
    EXPECT_EQ(hal::parse_duration_ns("50us"), 50'000);
    EXPECT_EQ(hal::parse_duration_ns("50µs"), 50'000);
    EXPECT_EQ(hal::parse_duration_ns("100ns"), 100);
    EXPECT_EQ(hal::parse_duration_ns("2min"), 120'000'000'000);
    EXPECT_EQ(hal::parse_duration_ns("1.5h"), 5'400'000'000'000);
    EXPECT_EQ(hal::parse_duration_ns("0.1s"), 100'000'000);
    EXPECT_EQ(hal::parse_duration_ns("12.5 ms"), 12'500'000);
}

TEST(Duration, without_unit_is_seconds_or_nanoseconds) {
    EXPECT_EQ(hal::parse_duration_ns("1000", 1.0), 1000);
    EXPECT_EQ(hal::parse_duration_ns("1000"), 1'000'000'000'000);
    EXPECT_EQ(hal::parse_duration_ns("1000", 0.0), std::nullopt) << "needs a unit";
    EXPECT_EQ(hal::parse_duration_ns("0", 0.0), 0);
}

TEST(Duration, rejects_what_has_no_number_or_no_known_unit) {
    for (const char* text : {"", "s", "-1s", "nan", "inf", "1e300s", "1x", "1ss", " 1s"}) {
        EXPECT_EQ(hal::parse_duration_ns(text, 1.0), std::nullopt) << text;
    }
}

TEST(Duration, is_printed_with_three_digits_and_a_fitting_unit) {
    EXPECT_EQ(hal::format_duration(0), "0 ns");
    EXPECT_EQ(hal::format_duration(850), "850 ns");
    EXPECT_EQ(hal::format_duration(12.5), "12.5 ns");
    EXPECT_EQ(hal::format_duration(12'000), "12 us");
    EXPECT_EQ(hal::format_duration(12'345), "12.3 us");
    EXPECT_EQ(hal::format_duration(1'500'000), "1.50 ms");
    EXPECT_EQ(hal::format_duration(999'600), "1.00 ms");
    EXPECT_EQ(hal::format_duration(10e9), "10 s");
    EXPECT_EQ(hal::format_duration(-12'000), "-12 us");
}

}  // namespace
