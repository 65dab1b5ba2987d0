// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "components/fieldbus/tdma/config/event_texts.hpp"

namespace {

TEST(TdmaPage, has_the_table_of_events) {
    std::ostringstream page;
    page << std::ifstream("docs/tdma.md").rdbuf();
    const std::string table = hal::bus::page_table(hal::tdma::event_rows);
    EXPECT_NE(page.str().find("\n\n" + table + "\n"), std::string::npos)
        << "the section Messages of docs/tdma.md must be:\n"
        << table;
}

}  // namespace
