// SPDX-License-Identifier: MIT
// The language of the table of lcec's devices.
#include "ethercat/config/lcec_table.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

namespace hal::ethercat::config {
namespace {

/// Returns the lines of a device as text: `[CONDITION] STEP: WORDS`.
std::vector<std::string> lines_of(const LcecTable& table, std::size_t device) {
    std::vector<std::string> texts;
    for (const auto& [conditions, words, step] : table.lines_of(table.devices().at(device))) {
        std::string text;
        for (const std::string& condition : conditions) {
            text += "[" + condition + "] ";
        }
        text += std::to_string(step) + ":";
        for (const std::string& word : words) {
            text += " " + word;
        }
        texts.push_back(text);
    }
    return texts;
}
using Lines = std::vector<std::string>;

std::string problem_of(const std::string& text) {
    try {
        const LcecTable table(text);
        lines_of(table, 0);
    } catch (const std::logic_error& problem) {
        return problem.what();
    }
    return "";
}

TEST(LcecTable, Values_replace_their_name_as_words_and_as_bits) {
    const LcecTable table(
        "values colours red=1\n"
        "    green=2\n"
        "values all $colours blue=3\n"
        "shape lamp\n"
        "  param colour 2000:01/8 $all\n"
        "  pdo 1a00 6000:01/8{$colours} 6000:02/8\n"
        "devices lamp 00000002\n"
        "  A 00000001\n");
    EXPECT_EQ(lines_of(table, 0), (Lines{"0: param colour 2000:01/8 red=1 green=2 blue=3",
                                         "0: pdo 1a00 6000:01/8{red=1,green=2} 6000:02/8"}));
}

TEST(LcecTable, Second_count_is_that_of_the_row_or_the_first) {
    const LcecTable table(
        "shape io\n"
        "  N* in #\n"
        "  M* out #\n"
        "devices io 00000002\n"
        "  A 00000001 1 2\n"
        "  B 00000002 1\n");
    EXPECT_EQ(lines_of(table, 0), (Lines{"0: in #", "0: out #", "1: out #"}));
    EXPECT_EQ(lines_of(table, 1), (Lines{"0: in #", "0: out #"}));
}

TEST(LcecTable, Names_count_from_0_from_1_or_from_a_number) {
    EXPECT_EQ(with_step("din-#", 3), "din-3");
    EXPECT_EQ(with_step("ch##x", 3), "ch4x");
    EXPECT_EQ(with_step("din-#+8", 3), "din-11");
    EXPECT_EQ(with_step("#+8-#", 0), "8-0");
}

TEST(LcecTable, A_shape_like_another_has_its_lines_with_a_text_and_the_step) {
    const LcecTable table(
        "shape axis\n"
        "  param %speed 2000+800:00/16\n"
        "  [mode=fast] 2* din %in-# in=6000:01\n"
        "shape one\n"
        "  like axis\n"
        "shape two\n"
        "  [kind=a] N* like axis ch##\n"
        "  sdo 2000:00/8 1\n"
        "devices one 00000002\n"
        "  A 00000001\n"
        "devices two 00000003\n"
        "  B 00000002 2\n");
    EXPECT_EQ(lines_of(table, 0),
              (Lines{"0: param speed 2000+800:00/16", "[mode=fast] 0: din in-# in=6000:01",
                     "[mode=fast] 1: din in-# in=6000:01"}));
    EXPECT_EQ(lines_of(table, 1),
              (Lines{"[kind=a] 0: param ch1speed 2000+800:00/16",
                     "[kind=a] [mode=fast] 0: din ch1in-# in=6000:01",
                     "[kind=a] [mode=fast] 1: din ch1in-# in=6000:01",
                     "[kind=a] 1: param ch2speed 2000+800:00/16",
                     "[kind=a] [mode=fast] 0: din ch2in-# in=6000:01",
                     "[kind=a] [mode=fast] 1: din ch2in-# in=6000:01", "0: sdo 2000:00/8 1"}));
}

TEST(LcecTable, A_row_with_several_names_is_a_device_for_each) {
    const LcecTable table(
        "shape lamp\n"
        "devices lamp 0000000A\n"
        "  A,B 000000FF 4 mode=slow\n"
        "unsupported C D\n"
        "unsupported E\n");
    ASSERT_EQ(table.devices().size(), 2U);
    for (const LcecDevice& device : table.devices()) {
        EXPECT_EQ(device.vendor, 10U);
        EXPECT_EQ(device.product, 255U);
        EXPECT_EQ(device.count, 4U);
        EXPECT_EQ(device.options.at(0), std::pair(std::string("mode"), std::string("slow")));
    }
    EXPECT_EQ(table.devices()[0].name, "A");
    EXPECT_EQ(table.devices()[1].name, "B");
    EXPECT_EQ(table.unsupported(), (TableWords{"C", "D", "E"}));
}

TEST(LcecTable, Unknown_names_are_rejected) {
    EXPECT_EQ(problem_of("shape a\n  param b 2000:01/8 $c\n"), "no values 'c' in the table");
    EXPECT_EQ(problem_of("shape a\n  like b\ndevices a 00000002\n  A 00000001\n"),
              "no shape 'b' in the table");
}

}  // namespace
}  // namespace hal::ethercat::config
