// SPDX-License-Identifier: MIT
// The pages have the tables that the readers of the files are made of.
#include "canopen/master/config/master_config.hpp"
#include "fieldbus/scocan/config/table.hpp"
#include "fieldbus/tdma/config/schedule.hpp"
#include "hal/read_file.hpp"
#ifdef HALCYON_ETHERCAT
#include "ethercat/config/config.hpp"
#endif

namespace hal {
namespace {

void expect_in_page(const std::string& path, const std::string& table) {
    std::string page;
    ASSERT_TRUE(read_regular_file(path, 1'000'000, page)) << page;
    EXPECT_NE(page.find(table), page.npos) << "write into " << path << ":\n" << table;
}

TEST(Reference, Tdma_page_has_the_keys_of_the_reader) {
    expect_in_page("docs/tdma.md", tdma::config::segment_reference());
    expect_in_page("docs/tdma.md", tdma::config::station_reference());
}

TEST(Reference, Canopen_page_has_the_keys_of_the_reader) {
    const std::string page = "docs/canopen-configuration.md";
    expect_in_page(page, canopen::config::bus_reference());
    expect_in_page(page, canopen::config::node_reference());
    expect_in_page(page, canopen::config::pdo_reference());
    expect_in_page(page, canopen::config::srdo_reference());
    expect_in_page(page, canopen::config::object_reference());
}

TEST(Reference, Scocan_page_has_the_keys_of_the_reader) {
    expect_in_page("docs/scocan.md", scocan::reference());
    expect_in_page("docs/scocan.md", scocan::message_reference());
}

#ifdef HALCYON_ETHERCAT
TEST(Reference, Ethercat_page_has_the_keys_of_the_reader) {
    const std::string page = "docs/ethercat-configuration.md";
    expect_in_page(page, ethercat::config::bus_reference());
    expect_in_page(page, ethercat::config::slave_reference());
    expect_in_page(page, ethercat::config::process_data_reference());
    expect_in_page(page, ethercat::config::clock_reference());
    expect_in_page(page, ethercat::config::object_reference());
}
#endif

}  // namespace
}  // namespace hal
