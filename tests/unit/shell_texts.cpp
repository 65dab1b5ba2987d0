// SPDX-License-Identifier: MIT
// Texts of the session: kept while something points into them, freed afterwards.
#include <algorithm>

#include "shell_machine.hpp"

namespace hal::test {
namespace {

bool has(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

TEST(Texts, texts_of_reverted_edits_are_freed) {
    ShellMachine machine;
    machine.must("loadrt and2 names=a\nnewthread t 1000000\n");
    const Sources& sources = machine.session.sources;
    const std::string large(2000, '#');
    std::size_t max = 0;
    std::size_t max_bytes = 0;
    for (int i = 0; i < 20'000; ++i) {
        const std::string name = "x" + std::to_string(i);
        EXPECT_EQ(machine.line("net " + name + " a.out " + (i % 10 == 0 ? large : "")), 0);
        EXPECT_EQ(machine.line("delsig " + name), 0);
        EXPECT_EQ(machine.line("net " + name + " nothing.out"), 1);
        max = std::max(max, sources.count());
        max_bytes = std::max(max_bytes, sources.bytes());
    }
    EXPECT_LT(max, 2000U);
    EXPECT_LT(max_bytes, 2U << 20);
}

TEST(Texts, texts_that_something_points_into_are_kept) {
    ShellMachine machine;
    machine.must("loadrt and2 names=a\nnewthread t 1000000\n");
    EXPECT_EQ(machine.file("net kept a.out\n", "first.hal"), 0);
    EXPECT_EQ(machine.line("begin"), 0);
    EXPECT_EQ(machine.line("net collected a.in0"), 0);
    Shell sibling(machine.shell, {});
    TextOutput output;
    for (int i = 0; i < 5000; ++i) {
        EXPECT_EQ(sibling.execute("newsig x" + std::to_string(i) + " bit", output), 0);
        EXPECT_EQ(sibling.execute("delsig x" + std::to_string(i), output), 0);
    }
    EXPECT_EQ(machine.line("commit"), 0) << machine.err;
    EXPECT_EQ(machine.line("newsig kept bit"), 1);
    EXPECT_TRUE(has(machine.err, "first.hal")) << machine.err;
    EXPECT_TRUE(has(machine.err, "net kept a.out")) << machine.err;
    EXPECT_EQ(machine.line("newsig collected bit"), 1);
    EXPECT_TRUE(has(machine.err, "net collected a.in0")) << machine.err;
}

}  // namespace
}  // namespace hal::test
