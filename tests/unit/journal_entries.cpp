// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>
#include <string>
#include <vector>

#include "journal/execution_journal.hpp"
#include "journal/journal_file.hpp"
#include "shell_machine.hpp"

namespace hal::test {
namespace {

std::vector<ExecutionEntry::Kind> kinds_in(const std::string& path) {
    JournalFile file;
    EXPECT_TRUE(file.open(path)) << file.problem();
    std::vector<ExecutionEntry::Kind> kinds;
    for (const ExecutionEntry& entry : file.entries()) {
        kinds.push_back(entry.kind);
    }
    return kinds;
}

TEST(ExecutionJournal, Has_a_stop_that_waits_for_no_lock_once_and_in_its_order) {
    const Folder folder;
    const std::string path = folder.path + "/run.mcap";
    ExecutionJournal journal(path, {"test", "1", "0"});
    SessionOptions options = shell_session("test", false);
    options.sink = &journal;
    {
        ShellMachine machine({}, options);
        ASSERT_EQ(0, machine.line("loadrt threads name1=servo period1=1000000"));
        ASSERT_EQ(0, machine.line("start"));
        machine.session.threads().halt();
        machine.session.threads().halt();
        ASSERT_EQ(0, machine.line("stop"));
        ASSERT_EQ(0, machine.line("start"));
        machine.session.threads().halt();
    }
    ASSERT_TRUE(journal.close()) << journal.problem();
    using enum ExecutionEntry::Kind;
    EXPECT_EQ((std::vector{edit, start, stop, start, stop, end}), kinds_in(path));
}

}  // namespace
}  // namespace hal::test
