// SPDX-License-Identifier: MIT
// The safety I/O node as a process has it: configured by hand over SDO, set by name, its state in a
// line.
#include "canopen/device/safety/safe_io.hpp"
#include "canopen/protocol/srdo_description.hpp"
#include "device_bench.hpp"

namespace hal::canopen::test {
namespace {

TEST(DeviceSafeIo, Sends_its_inputs_once_the_signature_is_right) {
    SafeIo io;
    Bench bench(io, {.node_id = 7});
    bench.start();
    EXPECT_TRUE(io.set("in-0", 1));
    bench.run(100 * millisecond);
    EXPECT_TRUE(bench.sent(0x10d).empty());
    EXPECT_EQ(io.summary(), "inputs 00000001, outputs 00000000, SRDOs not configured");
    bench.command(NmtCommand::enter_pre_operational);
    EXPECT_EQ(bench.write<std::uint8_t>(0x13fe, 0, 0xa5), Abort::value);
    const SrdoDescription d{.direction = SrdoDirection::sends,
                            .cycle_ms = 25,
                            .validation_ms = 20,
                            .cob = 0x10d,
                            .mapping = {map_entry(0x2300, 1, 8), map_entry(0x2301, 1, 8)}};
    EXPECT_EQ(bench.write<std::uint16_t>(0x13ff, 1, srdo_signature(d)), Abort::none);
    EXPECT_EQ(bench.write<std::uint8_t>(0x13fe, 0, 0xa5), Abort::none);
    bench.command(NmtCommand::start);
    bench.run(60 * millisecond);
    ASSERT_GE(bench.sent(0x10d).size(), 2U);
    EXPECT_EQ(bench.sent(0x10d)[0].data[0], 0x01);
    EXPECT_EQ(bench.sent(0x10e)[0].data[0], 0xfe);
    EXPECT_EQ(io.summary(), "inputs 00000001, outputs 00000000");
    bench.forget();
    EXPECT_TRUE(io.set("fail-safe", 1));
    bench.run(2 * millisecond);
    EXPECT_EQ(bench.sent(0x001).size(), 1U);
}

TEST(DeviceSafeIo, Knows_its_world_by_name) {
    SafeIo io;
    Bench bench(io, {.node_id = 7});
    for (const auto& name : io.settable()) {
        EXPECT_TRUE(io.set(name, 0)) << name;
    }
    for (const char* name : {"in-8", "in-", "in-10", "out-0", ""}) {
        EXPECT_FALSE(io.set(name, 1)) << name;
    }
}

TEST(DeviceSafeIo, Every_fault_of_its_SRDO_spoils_what_it_is_about) {
    struct Row {
        const char* fault;
        std::size_t plain, inverted;
        bool matches;
    };
    for (const auto& row :
         {Row{"no-srdo", 0, 0, true}, Row{"srdo-half", 1, 0, true}, Row{"srdo-wrong", 1, 1, false},
          Row{"srdo-order", 1, 1, true}, Row{"late-srdo:time=5ms", 1, 0, true}}) {
        SafeIo io({.inputs_cob = 0x10d});
        Bench bench(io, {.node_id = 7});
        Fault fault{};
        FaultSetting setting;
        std::string problem;
        ASSERT_TRUE(parse_fault(row.fault, fault, setting, problem)) << problem;
        bench.node.faults().set(fault, setting);
        bench.run(2 * millisecond);
        bench.command(NmtCommand::start);
        bench.run(2 * millisecond);
        EXPECT_EQ(bench.sent(0x10d).size(), row.plain) << row.fault;
        EXPECT_EQ(bench.sent(0x10e).size(), row.inverted) << row.fault;
        if (row.plain == 1 && row.inverted == 1) {
            EXPECT_EQ((bench.sent(0x10d)[0].data[0] ^ bench.sent(0x10e)[0].data[0]) == 0xff,
                      row.matches)
                << row.fault;
        }
        EXPECT_GT(bench.node.faults().hits(fault), 0U) << row.fault;
    }
}

}  // namespace
}  // namespace hal::canopen::test
