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

TEST(TdmaFaults, of_a_lost_sync_has_the_time_since_the_last_one) {
    const hal::tdma::config::Schedule schedule;
    hal::tdma::StationSetup setup;
    setup.lost_limit = 3;
    const hal::tdma::SegmentFaults faults(schedule, setup);
    const auto* const fault = faults.of(hal::tdma::Event::sync_lost, {});
    ASSERT_NE(fault, nullptr);
    EXPECT_EQ(fault->text,
              "lost the sync of the master for {} s (limit 3 cycles); this station stops sending "
              "until the next sync");
    EXPECT_DOUBLE_EQ(fault->detail(4'000'000), 0.004);
    EXPECT_EQ(faults.of(hal::tdma::Event::new_schedule, {})->text,
              "the master sends the syncs of a new schedule; this station stops sending until it "
              "follows them");
}

}  // namespace
