// SPDX-License-Identifier: MIT
// What a listener of the journal gets when more happens than is kept: a line that counts what is
// missing.
#include "machine/report/event_log.hpp"
#include "shell_machine.hpp"

namespace hal::test {
namespace {

constexpr std::size_t kept = 10'000;

struct JournalOfMachine : testing::Test {
    ShellMachine machine;
    EventLog& log = machine.session.event_log();
    EventLog::Position position = log.begin();
};

TEST_F(JournalOfMachine, counts_the_messages_that_nobody_collected) {
    for (std::size_t i = 0; i < kept + 3; ++i) {
        log.message("m" + std::to_string(i));
    }
    const auto entries = log.after(position);
    // the first of them was pushed out by the last line, and is counted
    ASSERT_EQ(entries.size(), kept + 1);
    EXPECT_EQ(entries.front().text, "missing here: 1 line, because the reader was too slow");
    EXPECT_EQ(entries.back().text, "missing here: 3 lines, because the reader was too slow");
    EXPECT_TRUE(log.after(position).empty());
}

TEST_F(JournalOfMachine, counts_the_entries_that_were_dropped_before_they_were_read) {
    for (std::size_t i = 0; i < kept + 7; ++i) {
        log.add("edit", "e" + std::to_string(i));
    }
    const auto entries = log.after(position);
    ASSERT_EQ(entries.size(), kept + 1);
    EXPECT_EQ(entries.front().text, "missing here: 7 lines, because the reader was too slow");
    EXPECT_EQ(entries[1].text, "e7");
    EXPECT_EQ(entries.back().text, "e10006");
}

}  // namespace
}  // namespace hal::test
