// SPDX-License-Identifier: MIT
// The parts of an address and its options, by the table of a kind of bus.
#include "link/address.hpp"

#include <gtest/gtest.h>

namespace {

using namespace hal::link;

struct AddressedOptions {
    bool flag = false;
    std::uint32_t number = 0;
};
constexpr OptionRow<AddressedOptions> rows[] = {
    {"flag", set_flag<&AddressedOptions::flag>},
    {"number", set_number<&AddressedOptions::number, 2, 9>},
};

/// Applies all options of a text. Returns the problem, or "".
std::string apply_all(std::string_view text, AddressedOptions& options) {
    Target target(text);
    while (!target.options.empty()) {
        std::string problem =
            apply_option<AddressedOptions>(rows, AddressOption::pop(target.options), options);
        if (!problem.empty()) return problem;
    }
    return {};
}

TEST(Address, Target_ends_the_place_at_the_first_question_mark) {
    const Target target("can0?a=1&b?");
    EXPECT_EQ("can0", target.place);
    EXPECT_EQ("a=1&b?", target.options);
    EXPECT_EQ("", Target("can0").options);
    EXPECT_EQ("", Target("can0?").options);
    EXPECT_EQ("", Target("").place);
}

TEST(Address, Pop_tells_an_empty_value_from_none) {
    std::string_view rest = "a=&b&c=x=y";
    const AddressOption a = AddressOption::pop(rest);
    const AddressOption b = AddressOption::pop(rest);
    const AddressOption c = AddressOption::pop(rest);
    EXPECT_TRUE(a.has_value);
    EXPECT_EQ("", a.value);
    EXPECT_FALSE(b.has_value);
    EXPECT_EQ("b", b.key);
    EXPECT_EQ("c", c.key);
    EXPECT_EQ("x=y", c.value);
    EXPECT_EQ("", rest);
}

TEST(Address, Options_set_their_values) {
    AddressedOptions options;
    EXPECT_EQ("", apply_all("x?flag&number=9", options));
    EXPECT_TRUE(options.flag);
    EXPECT_EQ(9U, options.number);
    EXPECT_EQ("", apply_all("x?flag=0", options));
    EXPECT_FALSE(options.flag);
}

TEST(Address, Invalid_options_are_named_with_what_to_write) {
    AddressedOptions options;
    EXPECT_EQ("invalid flag 'yes'; write 0 or 1", apply_all("x?flag=yes", options));
    for (const char* const value : {"1", "10", "", "3x", "-3"}) {
        EXPECT_EQ("invalid number '" + std::string(value) + "'; write a number 2..9",
                  apply_all("x?number=" + std::string(value), options));
    }
    EXPECT_EQ("unknown option 'other'; options are flag, number", apply_all("x?other", options));
    EXPECT_EQ(0U, options.number);
}

}  // namespace
