// SPDX-License-Identifier: MIT
// Configurations that are rejected.
#include <gtest/gtest.h>

#include "modbus/config/bus_config.hpp"

namespace hal::modbus::test {
namespace {

/// The messages of a slave with these lines.
std::string errors_of(const std::string& lines) {
    const ReadResult result =
        read("[bus]\nlink = sim:x\n[slave 1 s]\nstop = none\n" + lines, "a.modbus");
    return text::errors_text(result.messages, "a.modbus");
}

TEST(Config, Frequency_that_the_profile_cannot_command_is_rejected) {
    EXPECT_EQ("", errors_of("profile = delta-ms300\nmax-frequency = 655.35\n"));
    const std::string errors = errors_of("profile = delta-ms300\nmax-frequency = 1000\n");
    EXPECT_NE(std::string::npos, errors.find("max-frequency does not fit")) << errors;
    EXPECT_NE(std::string::npos, errors.find("write at most 655.35")) << errors;
    EXPECT_EQ("", errors_of("profile = delta-ms300\nmax-frequency = 1000\n"
                            "speed = holding 0x2001 50000\n"));
}

TEST(Config, Option_that_is_given_twice_is_rejected) {
    EXPECT_EQ("", errors_of("read a = holding 1 scale 2 unit scale\n"));
    const std::string errors = errors_of("read a = holding 1 scale 2 scale 3\n");
    EXPECT_NE(std::string::npos, errors.find("duplicate option 'scale'")) << errors;
}

TEST(Config, Name_of_the_age_of_another_value_is_rejected) {
    const std::string errors = errors_of("read a = holding 1 age\nread a-age = holding 2\n");
    EXPECT_NE(std::string::npos, errors.find("duplicate name 'a-age'")) << errors;
}

}  // namespace
}  // namespace hal::modbus::test
