// SPDX-License-Identifier: MIT
// What instances and nodes tell each other, and what is made of it when it is not what it should be.
#include "dds/words.hpp"

#include <gtest/gtest.h>

namespace hal::dds {
namespace {

TEST(DdsWords, a_status_goes_there_and_back_and_is_cut_at_its_largest) {
    const std::string text = "instance arm\nnode left\nnode right\nnodes 2\nnode\n";
    EXPECT_EQ(text, status_text(status_bytes(text)));
    EXPECT_EQ((std::vector<std::string>{"left", "right"}), values_of(text, "node"));
    EXPECT_EQ(largest_status, status_text(status_bytes(std::string(largest_status + 1, 'x'))).size());
}

TEST(DdsWords, bytes_that_are_no_status_are_an_empty_one) {
    std::vector<std::uint8_t> bytes = status_bytes("instance arm");
    for (std::size_t size = 0; size < bytes.size(); ++size) EXPECT_EQ("", status_text({bytes.data(), size})) << size;
    bytes[1] = 0;  // of the other byte order
    EXPECT_EQ("", status_text(bytes));
    bytes[1] = 1;
    bytes[4] = 0;  // a string has its 0 at least
    EXPECT_EQ("", status_text(bytes));
    bytes[7] = 0xFF;
    EXPECT_EQ("", status_text(bytes));
}

TEST(DdsWords, the_first_difference_of_two_layouts_is_named) {
    const auto topics = topics_of("cell/servo=x:float,y:bit;cell/slow=z:s32;nothing;");
    EXPECT_EQ(2u, topics.size());
    EXPECT_EQ("x:float,y:bit", topics.at("cell/servo"));
    EXPECT_EQ("", difference("x:float,y:bit", "a", "x:float,y:bit", "b"));
    EXPECT_EQ("signal 'y' is bit on node 'a' and s32 on node 'b'", difference("x:float,y:bit", "a", "x:float,y:s32", "b"));
    EXPECT_EQ("signal 'y' is known to node 'b' only", difference("x:float", "a", "x:float,y:bit", "b"));
    EXPECT_EQ("signal 'y' is known to node 'a' only", difference("x:float,y:bit", "a", "x:float", "b"));
    EXPECT_EQ("their signals stand in another order", difference("x:float,y:bit", "a", "y:bit,x:float", "b"));
}

TEST(DdsWords, what_comes_from_the_network_is_shown_on_one_short_line) {
    EXPECT_EQ("a?[2Jb?c", shown("a\x1b[2Jb\nc"));
    EXPECT_EQ("a\xc2?2Jb", shown("a\xc2\x9b" "2Jb"));  // the control sequence introducer of 8 bits
    EXPECT_EQ("Stra\xc3\x9f" "e", shown("Stra\xc3\x9f" "e"));
    EXPECT_EQ(600u, shown(std::string(5000, 'x')).size());
}

}  // namespace
}  // namespace hal::dds
