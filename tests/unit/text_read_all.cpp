// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>
#include <sstream>
#include <string>

#include "text/read_all.hpp"

namespace hal::test {
namespace {

std::string bytes(std::size_t count) {
    std::string content(count, '\0');
    for (std::size_t i = 0; i < count; ++i) {
        content[i] = static_cast<char>(i * 7);
    }
    return content;
}

TEST(ReadAll, returns_every_byte_whatever_the_size_of_its_blocks) {
    for (const std::size_t count : {0, 1, 65535, 65536, 65537, 200000}) {
        std::istringstream input(bytes(count));
        EXPECT_TRUE(read_all(input) == bytes(count)) << count;
    }
}

TEST(ReadAll, begins_at_the_current_position) {
    std::istringstream input("first\nsecond\n");
    std::string line;
    std::getline(input, line);
    EXPECT_EQ(read_all(input), "second\n");
}

TEST(ReadAll, returns_nothing_from_a_stream_that_has_failed) {
    std::istringstream input("text");
    input.setstate(std::ios::failbit);
    EXPECT_EQ(read_all(input), "");
}

}  // namespace
}  // namespace hal::test
