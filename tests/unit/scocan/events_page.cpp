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

TEST(ScocanFaults, name_the_owner_of_the_slot_of_an_identifier) {
    using namespace hal::scocan;
    Table table;
    table.nodes = {{.name = "motor"}, {.name = "sonar"}};
    Message position;
    position.name = "position";
    position.id = 0x10a;
    position.node = 1;
    table.messages.push_back(position);
    Use use;
    use.kind = Kind::priv;
    use.node = 0;
    use.ids = {0x10a};
    Mode mode;
    mode.name = "run";
    mode.slots = {{use}};
    table.modes.push_back(mode);
    const EventTexts texts(table, 1, "");
    EXPECT_EQ(texts.fault(Event::foreign_frame, 0x10a)->text,
              "frame 0x10A (position) in slot {}, outside of its own; probably sent by node motor");
}

}  // namespace
