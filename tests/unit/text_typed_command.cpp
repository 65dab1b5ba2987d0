// SPDX-License-Identifier: MIT
#include <cstdlib>
#include <gtest/gtest.h>

#include "text/typed_command.hpp"

namespace {

using hal::as_typed;

class TypedCommand : public testing::Test {
protected:
    void TearDown() override { unsetenv("HALCYON_STARTED_AS"); }
};

TEST_F(TypedCommand, text_is_unchanged_without_the_script) {
    EXPECT_EQ("type: hal run x.hal", as_typed("type: hal run x.hal"));
    setenv("HALCYON_STARTED_AS", "", 1);
    EXPECT_EQ("type: hal run x.hal", as_typed("type: hal run x.hal"));
}

TEST_F(TypedCommand, each_command_is_as_the_program_was_started) {
    setenv("HALCYON_STARTED_AS", "../hal", 1);
    EXPECT_EQ("../hal run x.hal", as_typed("hal run x.hal"));
    EXPECT_EQ("`../hal fmt` and (../hal doc pid), then ../hal run",
              as_typed("`hal fmt` and (hal doc pid), then hal run"));
}

TEST_F(TypedCommand, other_words_stay) {
    setenv("HALCYON_STARTED_AS", "../hal", 1);
    for (const char* const text :
         {"", "hal", "hal ", "a hal: b", "x.hal run", "./hal build", "marshal law", "hal 'x'"}) {
        EXPECT_EQ(text, as_typed(text));
    }
}

}  // namespace
