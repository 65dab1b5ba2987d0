// SPDX-License-Identifier: MIT
// Messages of ROS 2 from any writer: their numbers are read, and what is hostile is bounded.
#include <gtest/gtest.h>

#include <bit>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "recording/mcap/ros_message.hpp"

namespace hal::mcap {
namespace {

struct Decoded {
    std::vector<std::string> names, skipped;
    std::vector<std::uint64_t> row;
    bool good = false;
};

Decoded decode(std::string_view schema, std::string_view payload) {
    RosMessage message;
    Decoded all;
    if (!message.open("p/msg/X", schema)) return all;
    for (const RosMessage::Number& number : message.numbers()) {
        all.names.push_back(number.name);
    }
    all.skipped = message.skipped();
    all.good = message.read(payload, all.row);
    return all;
}

TEST(RosMessage, Texts_arrays_and_messages_are_skipped_with_their_alignment) {
    const Decoded all = decode(
        "string a\nuint8[] b\nint16[2] c\nY[] d\nY e\nfloat32 f\n===\nMSG: p/Y\nstring t\nint8 n\n",
        std::string_view("\0\1\0\0"
                         "\3\0\0\0hi\0\0"      // a
                         "\1\0\0\0\7\0\1\0"    // b, padding, c[0]
                         "\2\0\0\0\1\0\0\0"    // c[1], padding, one element of d
                         "\2\0\0\0x\0\5\0"     // its t and n
                         "\1\0\0\0\0\6\0\0"    // e: t and n, padding
                         "\0\0\xc0\x3f",
                         4 + 8 * 5 + 4));
    EXPECT_EQ(all.names, (std::vector<std::string>{"c.0", "c.1", "e.n", "f"}));
    EXPECT_EQ(all.skipped,
              (std::vector<std::string>{"a (string)", "b (uint8[])", "d (Y[])", "e.t (string)"}));
    ASSERT_TRUE(all.good);
    EXPECT_EQ(all.row, (std::vector<std::uint64_t>{1, 2, 6, std::bit_cast<std::uint64_t>(1.5)}));
}

TEST(RosMessage, Big_endian_and_xcdr2_are_read) {
    const std::uint64_t one = std::bit_cast<std::uint64_t>(1.0);
    EXPECT_EQ(decode("int8 a\nfloat64 b\n",
                     std::string_view("\0\0\0\0\2\0\0\0\0\0\0\0\x3f\xf0\0\0\0\0\0\0", 20))
                  .row,
              (std::vector<std::uint64_t>{2, one}));
    EXPECT_EQ(
        decode("int8 a\nfloat64 b\n", std::string_view("\0\7\0\0\2\0\0\0\0\0\0\0\0\0\xf0\x3f", 16))
            .row,
        (std::vector<std::uint64_t>{2, one}));
    EXPECT_FALSE(decode("int8 a\n", std::string_view("\0\3\0\0\2", 5)).good) << "PL_CDR";
}

TEST(RosMessage, Constants_defaults_and_comments_are_not_fields) {
    const Decoded all = decode(
        "uint8 MOST = 5\nstring A=\"x # y\"\nuint8 a 7 # b\nstring<=4 s \"a = b\"\n# int8 c\n\n  "
        "bool  d\r\n",
        std::string_view("\0\1\0\0\1\0\0\0\1\0\0\0\0\1", 14));
    EXPECT_EQ(all.names, (std::vector<std::string>{"a", "d"}));
    EXPECT_EQ(all.skipped, std::vector<std::string>{"s (string<=4)"});
    EXPECT_EQ(all.row, (std::vector<std::uint64_t>{1, 1}));
}

TEST(RosMessage, What_has_an_unknown_size_ends_what_is_read) {
    const Decoded all = decode("int8 a\nY b\nint8 c\n===\nMSG: p/Y\nint8 n\nwstring w\nint8 m\n",
                               std::string_view("\0\1\0\0\1\2", 6));
    EXPECT_EQ(all.names, (std::vector<std::string>{"a", "b.n"}));
    EXPECT_EQ(all.skipped, std::vector<std::string>{"w (wstring) and what comes after it"});
    EXPECT_TRUE(all.good);
    EXPECT_EQ(decode("int8 a\nX b\n", "").names, std::vector<std::string>{"a"})
        << "a message in itself has no end";
}

TEST(RosMessage, A_hostile_definition_is_bounded) {
    std::string doubling = "Y0 a\n";
    for (int i = 0; i < 30; ++i) {
        const std::string next = "Y" + std::to_string(i + 1);
        doubling += "===\nMSG: p/Y" + std::to_string(i) + "\n" + next + " a\n" + next + " b\n";
    }
    RosMessage message;
    EXPECT_FALSE(message.open("p/msg/X", doubling + "===\nMSG: p/Y30\nint8 n\n"));
    EXPECT_EQ(message.problem(), "it has more than 100000 fields");
    std::string long_arrays = "Y[60] a\n===\nMSG: p/Y\nZ[60] a\n===\nMSG: p/Z\nint8[60] n\n";
    EXPECT_FALSE(message.open("p/msg/X", long_arrays));
    std::vector<std::uint64_t> row;
    ASSERT_TRUE(message.open("p/msg/X", "int8 a\nfloat64[] b\nstring c\n"));
    EXPECT_FALSE(message.read(std::string_view("\0\1\0\0\1\0\0\0\xff\xff\xff\xff", 12), row))
        << "a count beyond the end";
}

}  // namespace
}  // namespace hal::mcap
