// SPDX-License-Identifier: MIT
// The page has the tables that the reader of an emulated card is made of.
#include "hal/read_file.hpp"
#include "mesa/card/card_config.hpp"
#include "mesa/card/card_fault.hpp"

namespace hal::mesa {
namespace {

void expect_in_page(const std::string& text) {
    std::string page;
    ASSERT_TRUE(read_regular_file("docs/mesa.md", 1'000'000, page)) << page;
    EXPECT_NE(page.find(text), page.npos) << "write into docs/mesa.md:\n" << text;
}

TEST(Reference, Page_has_the_keys_and_the_faults) {
    expect_in_page(card_reference());
    expect_in_page(motor_reference());
    expect_in_page(switch_reference());
    expect_in_page(spindle_reference());
    expect_in_page(wire_reference());
    for (const char* fault : card_fault_names) {
        expect_in_page(std::string("| `") + fault + "` |");
    }
}

}  // namespace
}  // namespace hal::mesa
