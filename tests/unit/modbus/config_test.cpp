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

TEST(Config, Broadcast_stop_is_a_stop_of_every_slave) {
    const std::string slave = "[slave 1 s]\nwrite a = holding 1\nstop = none\n";
    const ReadResult none = read("[bus]\nlink = sim:x\n" + slave, "a.modbus");
    EXPECT_FALSE(none.bus.has_stops());
    const ReadResult all = read(
        "[bus]\nlink = sim:x\nbroadcast-stop = holding 1 5, coil 2 0\nturnaround = 150ms\n" + slave,
        "a.modbus");
    EXPECT_TRUE(all.messages.empty());
    EXPECT_TRUE(all.bus.has_stops());
    ASSERT_EQ(2U, all.bus.broadcast_stop.size());
    EXPECT_EQ("coil 0x0002 := 0x0", write_text(all.bus.broadcast_stop[1]));
    EXPECT_EQ(150'000'000, all.bus.turnaround_ns);
    const ReadResult bad =
        read("[bus]\nlink = sim:x\nbroadcast-stop = input 1 5\n" + slave, "a.modbus");
    EXPECT_NE(std::string::npos,
              text::errors_text(bad.messages, "a.modbus").find("invalid write 'input 1 5'"));
}

TEST(Config, Slave_without_a_stop_telegram_of_its_own_is_warned_of) {
    const auto warnings = [](const std::string& bus, const std::string& stop) {
        std::string text;
        for (const auto& message :
             read("[bus]\nlink = sim:x\n" + bus + "[slave 7 s]\nwrite a = holding 1\n" + stop, "x")
                 .messages) {
            text += message.sentence + "\n" + message.help + "\n";
        }
        return text;
    };
    const std::string broadcast = "broadcast-stop = holding 1 5\n";
    EXPECT_EQ(warnings("", ""),
              "no stop telegram for slave 7, which is written to\n"
              "a slave keeps its last command when the machine ends; write stop = holding ADDRESS "
              "VALUE, or stop = none\n");
    EXPECT_EQ(warnings(broadcast, ""),
              "no stop telegram for slave 7, which is written to; it may miss the broadcast stop\n"
              "a broadcast that it misses is not repeated for it; write stop = holding ADDRESS "
              "VALUE, or stop = none\n");
    EXPECT_EQ(warnings(broadcast, "stop = none\n"), "");
    EXPECT_EQ(warnings(broadcast, "stop = holding 1 5\n"), "");
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
