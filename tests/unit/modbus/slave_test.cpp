// SPDX-License-Identifier: MIT
#include <cstdlib>

#include "world.hpp"

namespace hal::modbus::test {
namespace {

/// Returns why the only value of a slave cannot be set to a number.
std::string problem_of(const std::string& value, double number) {
    const ReadResult result =
        read("[bus]\nlink = sim:x\n[slave 1 s]\nread a = holding 0 " + value + "\n", "a.modbus");
    EXPECT_TRUE(result.good()) << text::errors_text(result.messages, "a.modbus");
    return EmulatedSlave(result.bus.slaves[0]).problem_of("a", number);
}

TEST(EmulatedSlave, Range_in_a_message_is_accepted_itself) {
    const struct {
        const char* value;
        const char* range;
    } cases[] = {
        {"u16", "0..65535"},
        {"s16 scale 0.1", "-3276.8..3276.7"},
        {"u32 scale 0.66666666666", "0..2863311529.9713669"},
        {"s32 offset 0.5", "-2147483647.5..2147483647.5"},
        {"u64", "0..9007199254740991"},
        {"s64", "-4503599627370496..4503599627370495"},
        {"f32", "-3.402823466e+38..3.402823466e+38"},
    };
    for (const auto& one : cases) {
        const std::string range = one.range;
        EXPECT_EQ(problem_of(one.value, -1e300), "out of range; write " + range) << one.value;
        EXPECT_EQ(problem_of(one.value, 1e300), "out of range; write " + range) << one.value;
        const std::size_t dots = range.find("..");
        EXPECT_EQ(problem_of(one.value, std::atof(range.c_str())), "") << one.value;
        EXPECT_EQ(problem_of(one.value, std::atof(range.c_str() + dots + 2)), "") << one.value;
    }
}

}  // namespace
}  // namespace hal::modbus::test
