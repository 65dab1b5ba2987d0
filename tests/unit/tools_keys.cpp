// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include "tools/cli/keys.hpp"
#include "tools/cli/raster.hpp"

namespace hal::tools {
namespace {

std::vector<Key> keys(std::string bytes, bool complete = true) { return pop_keys(bytes, complete); }
Key letter(char c) { return {Code::character, c, false}; }

TEST(Keys, letters_and_controls) {
    EXPECT_EQ(keys("q?\r\t\x7f"),
              (std::vector<Key>{
                  letter('q'), letter('?'), {Code::enter}, {Code::tab}, {Code::backspace}}));
    EXPECT_EQ(keys("\x01\xc3\xa4"), std::vector<Key>{})
        << "other control characters and non-ASCII are ignored";
}

TEST(Keys, arrows_come_as_csi_or_ss3_with_and_without_shift) {
    EXPECT_EQ(keys("\033[A\033OB\033[1;2C\033[D"),
              (std::vector<Key>{{Code::up}, {Code::down}, {Code::right, 0, true}, {Code::left}}));
    EXPECT_EQ(keys("\033[5~\033[6~"), (std::vector<Key>{{Code::page_up}, {Code::page_down}}));
}

TEST(Keys, unknown_sequences_are_skipped_whole) {
    EXPECT_EQ(keys("\033[200~\033[<0;12;7Mq"), std::vector<Key>{letter('q')});
}

TEST(Keys, a_sequence_in_two_reads_is_one_key) {
    std::string bytes = "a\033[1;";
    EXPECT_EQ(pop_keys(bytes, false), std::vector<Key>{letter('a')});
    EXPECT_EQ(bytes, "\033[1;");
    bytes += "2A";
    EXPECT_EQ(pop_keys(bytes, false), (std::vector<Key>{{Code::up, 0, true}}));
    EXPECT_EQ(bytes, "");
}

TEST(Keys, a_lone_escape_is_a_key_once_nothing_follows) {
    std::string bytes = "\033";
    EXPECT_EQ(pop_keys(bytes, false), std::vector<Key>{});
    EXPECT_EQ(pop_keys(bytes, true), std::vector<Key>{{Code::escape}});
    bytes = "\033[";
    EXPECT_EQ(pop_keys(bytes, true), std::vector<Key>{}) << "cut off: dropped";
    EXPECT_EQ(bytes, "");
}

TEST(Raster, a_character_takes_the_colour_of_its_newest_dot) {
    Raster raster(3, 1, true);
    raster.set(0, 0, 45);
    raster.set(1, 3, 214);
    raster.set(4, 0, 214);
    raster.set(99, 0, 1);
    EXPECT_EQ(raster.rows(), std::vector<std::string>{"\u2881\u2800\u2801"});
    EXPECT_EQ(raster.coloured_rows(),
              std::vector<std::string>{"\033[38;5;214m\u2881\u2800\u2801\033[39m"});
    EXPECT_TRUE(raster.taken(1, 1));
    EXPECT_FALSE(raster.taken(2, 0));
}

}  // namespace
}  // namespace hal::tools
