// SPDX-License-Identifier: MIT
// The page has the table that the messages are made of.
#include <string>

#include "fieldbus/guardian/stop_events.hpp"
#include "hal/read_file.hpp"

namespace hal::guardian {
namespace {

TEST(Reference, Page_has_the_messages) {
    std::string page;
    ASSERT_TRUE(read_regular_file("docs/stop-frames.md", 1'000'000, page)) << page;
    const std::string table = bus::page_table(event_rows);
    EXPECT_NE(page.find(table), page.npos) << "write into docs/stop-frames.md:\n" << table;
}

}  // namespace
}  // namespace hal::guardian
