// SPDX-License-Identifier: MIT
// The status text of instances and nodes, valid and malformed.
#include "dds/status_text.hpp"

#include <gtest/gtest.h>

namespace hal::dds {
namespace {

TEST(DdsStatusText, a_status_survives_the_round_trip_and_is_truncated_at_the_limit) {
    const std::string text = "instance arm\nnode left\nnode right\nnodes 2\nnode\n";
    EXPECT_EQ(text, status_text(status_bytes(text)));
    EXPECT_EQ((std::vector<std::string>{"left", "right"}), values_of(text, "node"));
    EXPECT_EQ(max_status_size,
              status_text(status_bytes(std::string(max_status_size + 1, 'x'))).size());
}

TEST(DdsStatusText, malformed_bytes_give_an_empty_status) {
    std::vector<std::uint8_t> bytes = status_bytes("instance arm");
    for (std::size_t size = 0; size < bytes.size(); ++size) {
        EXPECT_EQ("", status_text({bytes.data(), size})) << size;
    }
    bytes[1] = 0;  // of the other byte order
    EXPECT_EQ("", status_text(bytes));
    bytes[1] = 1;
    bytes[4] = 0;  // a string contains at least its 0
    EXPECT_EQ("", status_text(bytes));
    bytes[7] = 0xFF;
    EXPECT_EQ("", status_text(bytes));
}

TEST(DdsStatusText, difference_names_the_first_signal_that_differs) {
    const auto topics = topics_of("cell/servo=x:float,y:bit;cell/slow=z:s32;nothing;");
    EXPECT_EQ(2u, topics.size());
    EXPECT_EQ("x:float,y:bit", topics.at("cell/servo"));
    EXPECT_EQ("", difference("x:float,y:bit", "a", "x:float,y:bit", "b"));
    EXPECT_EQ("signal 'y' is bit on node 'a' and s32 on node 'b'",
              difference("x:float,y:bit", "a", "x:float,y:s32", "b"));
    EXPECT_EQ("signal 'y' exists on node 'b' only",
              difference("x:float", "a", "x:float,y:bit", "b"));
    EXPECT_EQ("signal 'y' exists on node 'a' only",
              difference("x:float,y:bit", "a", "x:float", "b"));
    EXPECT_EQ("the signals are in a different order",
              difference("x:float,y:bit", "a", "y:bit,x:float", "b"));
}

TEST(DdsStatusText, shown_removes_control_characters_and_truncates) {
    EXPECT_EQ("a?[2Jb?c", shown("a\x1b[2Jb\nc"));
    EXPECT_EQ("a\xc2?2Jb", shown("a\xc2\x9b"
                                 "2Jb"));  // the control sequence introducer of 8 bits
    EXPECT_EQ(
        "Stra\xc3\x9f"
        "e",
        shown("Stra\xc3\x9f"
              "e"));
    EXPECT_EQ(600u, shown(std::string(5000, 'x')).size());
}

}  // namespace
}  // namespace hal::dds
