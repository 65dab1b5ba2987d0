// SPDX-License-Identifier: MIT
// The page has the tables that the reader, the profiles and the events are made of.
#include "hal/read_file.hpp"
#include "modbus/config/bus_config.hpp"
#include "modbus/master/event_texts.hpp"

namespace hal::modbus {
namespace {

void expect_in_page(const std::string& table) {
    std::string page;
    ASSERT_TRUE(read_regular_file("docs/modbus.md", 1'000'000, page)) << page;
    EXPECT_NE(page.find(table), page.npos) << "write into docs/modbus.md:\n" << table;
}

TEST(Reference, Page_has_the_keys_the_profiles_and_the_messages) {
    expect_in_page(bus_reference());
    expect_in_page(slave_reference());
    expect_in_page(drive_reference());
    expect_in_page(profile_reference());
    expect_in_page(bus::page_table(event_rows));
}

}  // namespace
}  // namespace hal::modbus
