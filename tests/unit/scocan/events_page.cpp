// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "components/fieldbus/scocan/plugins/event_texts.hpp"

namespace {

TEST(ScocanPage, has_the_table_of_events) {
    std::ostringstream page;
    page << std::ifstream("docs/scocan.md").rdbuf();
    const std::string table = hal::bus::page_table(hal::scocan::event_rows);
    EXPECT_NE(page.str().find("\n\n" + table + "\n"), std::string::npos)
        << "the section Messages of docs/scocan.md must be:\n"
        << table;
}

}  // namespace
