// SPDX-License-Identifier: MIT
// The page has the table of the driver's events.
#include <gtest/gtest.h>

#include "hal/read_file.hpp"
#include "mesa/plugins/event_texts.hpp"

namespace hal::mesa {
namespace {

TEST(Reference, Page_has_the_events_of_the_driver) {
    std::string page;
    ASSERT_TRUE(read_regular_file("docs/mesa.md", 1'000'000, page)) << page;
    const std::string table = bus::page_table(event_rows);
    EXPECT_NE(page.find(table), page.npos) << "write into docs/mesa.md:\n" << table;
}

TEST(EventTexts, Name_the_card_the_unit_and_the_reaction) {
    const EventTexts texts("eth:10.10.10.10 (7I92)", {"the device 7i76.0.1"},
                           {"unknown module (tag 0x77) is not used"}, 3);
    EXPECT_EQ(texts.line({Event::lost, 0, 5}),
              "the card eth:10.10.10.10 (7I92) is lost: no answer in 5 cycles; check its power and "
              "its cable");
    EXPECT_EQ(texts.line({Event::remote_lost, 0, 0}),
              "the device 7i76.0.1 does not answer; check its cable and its field power");
    EXPECT_EQ(texts.line({Event::module_unused, 0, 0}),
              "the card eth:10.10.10.10 (7I92): unknown module (tag 0x77) is not used");
    ASSERT_NE(texts.fault({Event::position_lost, 2, 0}), nullptr);
    EXPECT_EQ(texts.fault({Event::position_lost, 2, 0})->text,
              "stepgen 02 has lost its position: its motor may not have followed its steps; it "
              "stands until enable was FALSE");
    EXPECT_EQ(texts.fault({Event::online, 0, 0}), nullptr);
}

}  // namespace
}  // namespace hal::mesa
