// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <concepts>
#include <limits>

#include "unit/components/component_host.hpp"

namespace {

using hal::test::Instance;
using i32 = std::int32_t;
using u32 = std::uint32_t;
using i64 = std::int64_t;
using u64 = std::uint64_t;
constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double infinity = std::numeric_limits<double>::infinity();

template <class From, class To>
struct Case {
    From in;
    To wrapped, clamped;
    bool fits;
};

/// Runs the cases through a converter that has a choice.
template <class From, class To>
void check(const std::string& component, std::initializer_list<Case<From, To>> cases) {
    Instance converter(component);
    for (const auto& c : cases) {
        converter.set("in", From{});
        converter.set("clamp", true);
        converter.run();  // clears out-of-range
        converter.set("in", c.in);
        const bool has_fraction =
            std::same_as<From, double> &&
            std::trunc(static_cast<double>(c.in)) != static_cast<double>(c.in);
        for (const bool clamp : {false, true}) {
            converter.set("clamp", clamp);
            converter.run();
            EXPECT_EQ(converter.get<To>("out"), clamp ? c.clamped : c.wrapped)
                << component << " of " << c.in << (clamp ? " clamped" : "");
            EXPECT_EQ(converter.get<bool>("out-of-range"), !c.fits || (has_fraction && !clamp))
                << component << " of " << c.in;
        }
    }
}

/// Runs the values through a converter that never has to choose.
template <class From, class To>
void check_exact(const std::string& component, std::initializer_list<std::pair<From, To>> cases) {
    Instance converter(component);
    EXPECT_FALSE(converter.has_pin("clamp")) << component;
    for (const auto& [in, out] : cases) {
        converter.set("in", in);
        converter.run();
        EXPECT_EQ(converter.get<To>("out"), out) << component << " of " << in;
    }
}

TEST(Conv, Of_a_bit_gives_zero_or_one) {
    check_exact<bool, double>("conv_bit_float", {{false, 0.0}, {true, 1.0}});
    check_exact<bool, i32>("conv_bit_s32", {{false, 0}, {true, 1}});
    check_exact<bool, u32>("conv_bit_u32", {{false, 0}, {true, 1}});
    check_exact<bool, i64>("conv_bit_s64", {{false, 0}, {true, 1}});
    check_exact<bool, u64>("conv_bit_u64", {{false, 0}, {true, 1}});
}

TEST(Conv, To_float_and_to_a_wider_integer_is_exact) {
    check_exact<i32, double>("conv_s32_float", {{INT32_MIN, -2147483648.0}, {7, 7.0}});
    check_exact<u32, double>("conv_u32_float", {{UINT32_MAX, 4294967295.0}});
    check_exact<i64, double>("conv_s64_float", {{-(i64{1} << 53), -9007199254740992.0}});
    check_exact<u64, double>("conv_u64_float", {{u64{1} << 63, 9223372036854775808.0}});
    check_exact<i32, i64>("conv_s32_s64", {{INT32_MIN, INT32_MIN}, {INT32_MAX, INT32_MAX}});
    check_exact<u32, i64>("conv_u32_s64", {{UINT32_MAX, i64{UINT32_MAX}}});
    check_exact<u32, u64>("conv_u32_u64", {{UINT32_MAX, u64{UINT32_MAX}}});
}

TEST(Conv, To_a_bit_is_true_for_all_but_zero_and_reports_what_is_neither_0_nor_1) {
    check<i32, bool>("conv_s32_bit", {{0, false, false, true},
                                      {1, true, true, true},
                                      {2, true, true, false},
                                      {-1, true, false, false}});
    check<u32, bool>(
        "conv_u32_bit",
        {{0, false, false, true}, {1, true, true, true}, {UINT32_MAX, true, true, false}});
    check<i64, bool>(
        "conv_s64_bit",
        {{i64{1} << 40, true, true, false}, {-1, true, false, false}, {0, false, false, true}});
    check<u64, bool>("conv_u64_bit", {{u64{1} << 63, true, true, false}, {1, true, true, true}});
}

TEST(Conv, Of_a_float_cuts_the_fraction_and_wraps_or_clamps) {
    check<double, i32>("conv_float_s32", {{1.9, 1, 1, true},
                                          {-1.9, -1, -1, true},
                                          {2147483647.0, INT32_MAX, INT32_MAX, true},
                                          {-2147483648.0, INT32_MIN, INT32_MIN, true},
                                          {2147483648.0, INT32_MIN, INT32_MAX, false},
                                          {4294967301.0, 5, INT32_MAX, false},
                                          {-2147483649.0, INT32_MAX, INT32_MIN, false},
                                          {1e300, 0, INT32_MAX, false},
                                          {infinity, 0, INT32_MAX, false},
                                          {-infinity, 0, INT32_MIN, false},
                                          {nan, 0, 0, false}});
    check<double, u32>("conv_float_u32", {{4294967295.0, UINT32_MAX, UINT32_MAX, true},
                                          {4294967296.0, 0, UINT32_MAX, false},
                                          {-1.0, UINT32_MAX, 0, false},
                                          {nan, 0, 0, false}});
    check<double, i64>("conv_float_s64",
                       {{-9223372036854775808.0, INT64_MIN, INT64_MIN, true},
                        {9223372036854774784.0, 9223372036854774784, 9223372036854774784, true},
                        {9223372036854775808.0, INT64_MIN, INT64_MAX, false},
                        {18446744073709551616.0, 0, INT64_MAX, false},
                        {nan, 0, 0, false}});
    check<double, u64>("conv_float_u64", {{18446744073709549568.0, 18446744073709549568u,
                                           18446744073709549568u, true},
                                          {18446744073709551616.0, 0, UINT64_MAX, false},
                                          {-2.5, UINT64_MAX - 1, 0, false},
                                          {infinity, 0, UINT64_MAX, false}});
}

TEST(Conv, Without_clamp_out_of_range_remains_set) {
    Instance converter("conv_float_s32");
    const auto out_of_range = [&](double in) {
        converter.set("in", in);
        converter.run();
        return converter.get<bool>("out-of-range");
    };
    EXPECT_FALSE(out_of_range(1.0));
    EXPECT_TRUE(out_of_range(1.5));
    EXPECT_TRUE(out_of_range(2.0));
    converter.set("clamp", true);
    EXPECT_FALSE(out_of_range(2.5));
    EXPECT_TRUE(out_of_range(3e9));
    converter.set("clamp", false);
    EXPECT_TRUE(out_of_range(1.0));
}

TEST(Conv, Between_integers_wraps_or_clamps) {
    check<i32, u32>("conv_s32_u32", {{5, 5, 5, true}, {-1, UINT32_MAX, 0, false}});
    check<i32, u64>("conv_s32_u64", {{5, 5, 5, true}, {-1, UINT64_MAX, 0, false}});
    check<u32, i32>("conv_u32_s32",
                    {{INT32_MAX, INT32_MAX, INT32_MAX, true}, {UINT32_MAX, -1, INT32_MAX, false}});
    check<i64, i32>("conv_s64_s32", {{-7, -7, -7, true},
                                     {(i64{1} << 32) + 3, 3, INT32_MAX, false},
                                     {INT64_MIN, 0, INT32_MIN, false}});
    check<i64, u32>("conv_s64_u32", {{UINT32_MAX, UINT32_MAX, UINT32_MAX, true},
                                     {-1, UINT32_MAX, 0, false},
                                     {i64{1} << 32, 0, UINT32_MAX, false}});
    check<i64, u64>("conv_s64_u64",
                    {{INT64_MAX, INT64_MAX, INT64_MAX, true}, {-1, UINT64_MAX, 0, false}});
    check<u64, i32>("conv_u64_s32", {{9, 9, 9, true}, {UINT64_MAX, -1, INT32_MAX, false}});
    check<u64, u32>("conv_u64_u32", {{UINT32_MAX, UINT32_MAX, UINT32_MAX, true},
                                     {(u64{1} << 32) + 8, 8, UINT32_MAX, false}});
    check<u64, i64>("conv_u64_s64",
                    {{INT64_MAX, INT64_MAX, INT64_MAX, true}, {UINT64_MAX, -1, INT64_MAX, false}});
}

}  // namespace
