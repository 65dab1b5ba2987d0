// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <sstream>

#include "components/canopen/plugins/fault_messages.hpp"

namespace hal::canopen::test {
namespace {

TEST(CanopenPage, has_the_tables_of_events_and_faults) {
    std::ostringstream page;
    page << std::ifstream("docs/canopen-configuration.md").rdbuf();
    for (const std::string& table :
         {bus::page_table(bus_event_rows), bus::page_table(node_fault_rows),
          bus::page_table(boot_fault_rows), bus::page_table(pdo_fault_rows)}) {
        EXPECT_NE(page.str().find("\n\n" + table), std::string::npos)
            << "the section Messages and faults of docs/canopen-configuration.md must have:\n"
            << table;
    }
}

struct CanopenFaults : testing::Test {
    config::MasterConfig config;
    config::Pdo pdo;
    std::vector<Received> received;

    void SetUp() override {
        config.node_id = 127;
        config::Node& node = config.nodes.emplace_back();
        node.name = node.setup.name = "motor";
        node.setup.id = 2;
        node.setup.heartbeat_ms = 50;
        pdo.number = 1;
        pdo.cob = 0x182;
        received.push_back({0, &pdo, 1});
    }
};

TEST_F(CanopenFaults, of_a_node_have_its_name_the_time_and_the_reaction) {
    const FaultMessages messages(config, received);
    NodeStatus status;
    status.cause = Cause::heartbeat;
    const FaultMessages::Fault& lost = messages.lost(0, status);
    EXPECT_EQ(
        lost.text,
        "node 2 (motor): no heartbeat for {} s (timeout 0.125 s); outputs set to safe values");
    EXPECT_DOUBLE_EQ(lost.detail(125 * millisecond), 0.125);
    status.cause = Cause::boot_up;
    EXPECT_EQ(messages.lost(0, status).text,
              "node 2 (motor): rebooted without a command from this master; outputs set to safe "
              "values");
    EXPECT_TRUE(std::isnan(messages.lost(0, status).detail(1)));
    status.foreign_command = 129;
    EXPECT_EQ(
        messages.lost(0, status).text,
        "node 2 (motor): rebooted after an NMT reset from another device; outputs set to safe "
        "values");
}

TEST_F(CanopenFaults, of_a_boot_have_the_result) {
    const FaultMessages messages(config, received);
    NodeStatus status;
    status.cause = Cause::mismatch;
    status.result = BootResult::vendor;
    EXPECT_EQ(messages.not_booted(0, status).text, std::string("node 2 (motor): boot failed: ") +
                                                       to_string(BootResult::vendor) +
                                                       " (result D)");
    status.cause = Cause::not_started;
    EXPECT_EQ(messages.not_booted(0, status).text,
              "node 2 (motor): did not become operational after the start command; outputs set to "
              "safe values");
}

TEST_F(CanopenFaults, of_a_PDO_and_of_the_bus_have_their_numbers) {
    const FaultMessages messages(config, received);
    EXPECT_EQ(messages.of(PdoFault::late, 0).text,
              "node 2 (motor): tpdo1 (182) not received or too short for {} s");
    EXPECT_EQ(
        messages.of(PdoFault::too_short, 0).text,
        "node 2 (motor): tpdo1 (182) has {} bytes, its mapped objects need 0; pins keep their "
        "values; to see the mapping of the node: hal can pdo show");
    EXPECT_EQ(messages.of(BusEvent::own_id).text,
              "duplicate node ID 127: another device has the node ID of the master; change one: "
              "node-id in [bus], or masternodeid=");
    EXPECT_EQ(messages.of(BusEvent::foreign_sync).text,
              "another device also produces SYNC; nodes act on both");
    EXPECT_EQ(messages.of(BusEvent::foreign_rpdo).text,
              "another device also sends RPDO {x} of a node of this master; the node follows both");
    EXPECT_DOUBLE_EQ(messages.of(BusEvent::sync_missing).detail(second / 2), 0.5);
}

}  // namespace
}  // namespace hal::canopen::test
