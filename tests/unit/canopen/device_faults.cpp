// SPDX-License-Identifier: MIT
#include "canopen/device/io/io.hpp"
#include "device_bench.hpp"
#include "link/simulation.hpp"

namespace hal::canopen::test {
namespace {

struct FaultyDevice : testing::Test {
    Io io{IoSettings{}};
    Bench bench{io};
    void SetUp() override {
        bench.start();
        bench.forget();
    }
    void set(const std::string& text) {
        Fault fault{};
        FaultSetting setting;
        std::string problem;
        ASSERT_TRUE(parse_fault(text, fault, setting, problem)) << problem;
        bench.node.faults().set(fault, setting);
    }
    void end(Fault fault) { bench.node.faults().set(fault, {}); }
    std::uint32_t type() { return bench.read<std::uint32_t>(0x1000, 0); }
};

TEST_F(FaultyDevice, is_mute_for_a_time) {
    set("mute:from=5s:for=1s");
    EXPECT_EQ(type(), 0xf0191U);
    bench.run(5 * second, 10 * millisecond);
    type();
    EXPECT_EQ(bench.last_abort, Abort::timeout);
    bench.run(2 * second, 10 * millisecond);
    EXPECT_EQ(type(), 0xf0191U);
    EXPECT_GT(bench.node.faults().hits(Fault::mute), 0U);
}

TEST_F(FaultyDevice, loses_every_third_frame_and_the_client_gets_through) {
    set("mute:every=3");
    for (int n = 0; n < 10; ++n) {
        EXPECT_EQ(type(), 0xf0191U);
    }
    EXPECT_GT(bench.remote().sdo().retries(), 2U);
}

TEST_F(FaultyDevice, does_not_hear) {
    set("deaf");
    type();
    EXPECT_EQ(bench.last_abort, Abort::timeout);
}

TEST_F(FaultyDevice, answers_late) {
    set("late-sdo:time=30ms");
    const Time began = bench.now;
    EXPECT_EQ(type(), 0xf0191U);
    EXPECT_GE(bench.now - began, 30 * millisecond);
    set("late-sdo:time=150ms");  // later than the client waits
    type();
    bench.run(second);
    EXPECT_GT(bench.remote().sdo().unexpected_responses() + bench.remote().sdo().retries(), 0U);
}

TEST_F(FaultyDevice, sends_PDOs_of_wrong_length_or_late) {
    const auto pdo = [&] {
        bench.forget();
        io.set_input(0, !(bench.node.device().dictionary().get<std::uint8_t>(0x6000, 1) & 1));
        bench.run(2 * millisecond);
        return bench.sent(0x185);
    };
    set("short-pdo");
    ASSERT_EQ(pdo().size(), 1U);
    EXPECT_EQ(bench.sent(0x185)[0].length, 7);
    end(Fault::short_pdo);
    EXPECT_EQ(pdo()[0].length, 8);
    set("late-pdo:time=20ms");
    EXPECT_TRUE(pdo().empty());
    bench.run(20 * millisecond);
    EXPECT_EQ(bench.sent(0x185).size(), 1U);
    end(Fault::late_pdo);
    set("twice");
    EXPECT_EQ(pdo().size(), 2U);
}

TEST_F(FaultyDevice, tells_a_wrong_identity) {
    for (const char* fault :
         {"wrong-type", "wrong-vendor", "wrong-product", "wrong-revision", "wrong-serial"}) {
        set(fault);
    }
    EXPECT_EQ(type(), 0xf0191U ^ 0xff);
    EXPECT_EQ(bench.read<std::uint32_t>(0x1018, 1), example_vendor ^ 0xff);
    EXPECT_EQ(bench.read<std::uint32_t>(0x1018, 2), 0x401U ^ 0xff);
    EXPECT_EQ(bench.read<std::uint32_t>(0x1018, 3), 0x10000U ^ 0xff);
    EXPECT_EQ(bench.read<std::uint32_t>(0x1018, 4), 1U ^ 0xff);
    EXPECT_EQ(bench.read<std::uint8_t>(0x1018, 0), 4);
}

TEST_F(FaultyDevice, aborts) {
    set("abort:every=2");
    EXPECT_EQ(type(), 0xf0191U);
    type();
    EXPECT_EQ(bench.last_abort, Abort::general);
    end(Fault::abort);
    set("no-sdo");
    type();
    EXPECT_EQ(bench.last_abort, Abort::timeout);
}

TEST_F(FaultyDevice, sends_stale_aborts_which_the_client_drops) {
    EXPECT_EQ(bench.read<std::uint32_t>(0x1018, 1), example_vendor);
    set("stale-abort");
    EXPECT_EQ(type(), 0xf0191U);
    EXPECT_EQ(bench.remote().sdo().unexpected_responses(), 1U);
    const auto answers = bench.sent(0x585);
    const auto& stale = answers[answers.size() - 2];
    EXPECT_EQ(stale.data[0], 0x80);
    EXPECT_EQ(load<std::uint16_t>(stale.data.data() + 1), 0x1018);
}

/// A device with a domain, large enough for blocks.
struct Store final : Program {
    Description description() const override {
        Description d = basic_device({.vendor = 1, .name = "store"});
        d.add_domain(0x2000, 0, Access::read_write, 1000, "Data");
        return d;
    }
};

TEST(FaultyTransfers, end_as_the_protocol_wants) {
    Store store;
    Bench bench(store);
    bench.start();
    const auto set = [&](const char* text) {
        Fault fault{};
        FaultSetting setting;
        std::string problem;
        ASSERT_TRUE(parse_fault(text, fault, setting, problem)) << problem;
        for (const auto& row : fault_rows()) {
            bench.node.faults().set(row.fault, {});
        }
        bench.node.faults().set(fault, setting);
    };
    std::vector<std::uint8_t> data(900), back;
    for (std::size_t n = 0; n < data.size(); ++n) {
        data[n] = static_cast<std::uint8_t>(n * 7);
    }
    ASSERT_EQ(bench.write(0x2000, 0, data, SdoMode::block), Abort::none);
    set("toggle");
    EXPECT_EQ(bench.read(0x2000, 0, back), Abort::toggle);
    set("toggle:every=140");  // a transfer begun again gets through
    EXPECT_EQ(bench.read(0x2000, 0, back), Abort::none);
    EXPECT_EQ(back, data);
    set("block-gap:every=20");
    EXPECT_EQ(bench.read(0x2000, 0, back, SdoMode::block), Abort::none);
    EXPECT_EQ(back, data);
    EXPECT_GT(bench.node.faults().hits(Fault::block_gap), 5U);
    set("block-crc");
    EXPECT_EQ(bench.read(0x2000, 0, back, SdoMode::block), Abort::crc);
    EXPECT_EQ(bench.write(0x2000, 0, data, SdoMode::block), Abort::crc);
    // block transfer by default, segmented transfer when blocks fail
    std::vector<std::uint8_t> many(1000, 0x5a);
    EXPECT_EQ(bench.write(0x2000, 0, many), Abort::none);
    EXPECT_EQ(bench.read(0x2000, 0, back), Abort::none);
    EXPECT_EQ(back, many);
    ASSERT_EQ(bench.write(0x2000, 0, data, SdoMode::segmented), Abort::none);
    set("stale-abort");
    EXPECT_EQ(bench.read<std::uint32_t>(0x1018, 1), 1U);  // what the aborts are about
    EXPECT_EQ(bench.read(0x2000, 0, back, SdoMode::block), Abort::none);
    EXPECT_EQ(bench.read<std::uint32_t>(0x1018, 1), 1U);
    EXPECT_EQ(bench.write(0x2000, 0, data, SdoMode::block), Abort::none);
    EXPECT_EQ(back, data);
}

TEST_F(FaultyDevice, has_trouble_with_its_heartbeat) {
    ASSERT_EQ(bench.write<std::uint16_t>(0x1017, 0, 10), Abort::none);
    bench.run(30 * millisecond);
    EXPECT_EQ(bench.remote().state(), NmtState::operational);
    set("wrong-state");
    bench.run(30 * millisecond);
    EXPECT_EQ(bench.remote().state(), NmtState::stopped);
    set("no-heartbeat");
    bench.forget();
    bench.run(100 * millisecond);
    EXPECT_TRUE(bench.sent(0x705).empty());
    end(Fault::no_heartbeat);
    set("boot-storm:time=20ms");
    const auto booted = bench.remote().boot_ups();
    bench.run(105 * millisecond);
    EXPECT_EQ(bench.remote().boot_ups() - booted, 5U);
    EXPECT_EQ(bench.node.device().state(), NmtState::operational);
}

TEST_F(FaultyDevice, guards_with_a_wrong_toggle_bit) {
    bench.remote().guard(10 * millisecond, 4, bench.now);
    bench.run(100 * millisecond);
    EXPECT_EQ(bench.remote().wrong_toggles(), 0U);
    EXPECT_FALSE(bench.remote().lost());
    set("guard-toggle:every=8");  // twice in a row the same now and then
    bench.run(400 * millisecond);
    EXPECT_GT(bench.remote().wrong_toggles(), 2U);
    EXPECT_FALSE(bench.remote().lost());
    end(Fault::guard_toggle);
    bench.run(100 * millisecond);
    const auto wrong = bench.remote().wrong_toggles();
    // an answer is lost: the next one has the toggle bit of the last that came
    set("no-heartbeat:every=8");
    bench.run(400 * millisecond);
    EXPECT_EQ(bench.remote().wrong_toggles(), wrong);
    EXPECT_FALSE(bench.remote().lost());
}

TEST_F(FaultyDevice, is_lost_when_its_toggle_bit_never_changes) {
    bench.remote().guard(10 * millisecond, 3, bench.now);
    bench.run(100 * millisecond);
    set("guard-toggle:every=2");
    bench.run(20 * millisecond);
    EXPECT_FALSE(bench.remote().lost());
    bench.run(30 * millisecond);
    EXPECT_TRUE(bench.remote().lost());
    EXPECT_TRUE(bench.remote().toggle_stuck());
    end(Fault::guard_toggle);
    bench.run(30 * millisecond);
    EXPECT_FALSE(bench.remote().lost());
    set("no-heartbeat");  // silence is another reason
    bench.run(50 * millisecond);
    EXPECT_TRUE(bench.remote().lost());
    EXPECT_FALSE(bench.remote().toggle_stuck());
}

TEST_F(FaultyDevice, loses_its_power_again_and_again) {
    ASSERT_EQ(bench.write<std::uint8_t>(0x6202, 1, 0x11), Abort::none);
    set("reboot:time=100ms");
    bench.run(350 * millisecond);
    EXPECT_EQ(bench.remote().boot_ups(), 4U);  // the first at power-on
    EXPECT_EQ(bench.read<std::uint8_t>(0x6202, 1), 0);
    EXPECT_EQ(bench.node.device().state(), NmtState::pre_operational);
}

TEST_F(FaultyDevice, babbles_and_cries) {
    set("babble:time=500us");
    set("emcy-storm:time=10ms");
    bench.run(100 * millisecond);
    EXPECT_NEAR(static_cast<double>(bench.sent(0x001).size()), 200, 4);
    EXPECT_NEAR(static_cast<double>(bench.remote().emergencies()), 10, 1);
    end(Fault::babble);
    bench.run(5 * millisecond);
    bench.forget();
    bench.run(5 * millisecond);
    EXPECT_TRUE(bench.sent(0x001).empty());
}

TEST_F(FaultyDevice, can_be_powered_without_saying_so) {
    set("no-boot-up");
    bench.node.power(false);
    bench.run(5 * millisecond);
    bench.node.power(true);
    bench.run(5 * millisecond);
    EXPECT_TRUE(bench.sent(0x705).empty());
    EXPECT_EQ(bench.node.device().state(), NmtState::pre_operational);
}

TEST(BusOff, is_told_by_every_device_when_the_bus_is_back) {
    IoSettings settings;
    settings.heartbeat_ms = 10;
    Io io{settings};
    Node node(io, can::open("sim:bus-off?bitrate=1M").link, {.node_id = 5});
    const auto master = can::open("sim:bus-off").link;
    std::vector<Frame> told;
    Time now = second;
    const auto run = [&](Time time) {
        for (const Time end = now + time; now < end;) {
            node.turn(now += millisecond);
            for (Frame f; master->receive(f, now);) {
                if (f.id == 0x85 && !f.error) {
                    told.push_back(f);
                }
            }
        }
    };
    run(5 * millisecond);
    master->send({0, {1, 5}}, now);
    master->flush(now);
    run(5 * millisecond);
    ASSERT_EQ(node.device().state(), NmtState::operational);
    auto* wire = node.link().simulation();
    can::Disturbance broken;
    // 32 errors of 8 are 256
    broken.fault = can::Fault::error;
    broken.every = 1;
    broken.node = wire->node();

    broken.count = 32;
    wire->disturb(broken);
    run(30 * millisecond);
    ASSERT_EQ(node.link().state(), can::State::bus_off);
    EXPECT_EQ(node.device().emcy().error_register(), error_generic | error_communication);
    EXPECT_EQ(node.device().state(), NmtState::pre_operational);  // as configured in 1029h
    EXPECT_TRUE(told.empty());
    run(200 * millisecond);
    ASSERT_EQ(node.link().state(), can::State::active);
    ASSERT_EQ(told.size(), 2U);
    EXPECT_EQ(load<std::uint16_t>(told[0].data.data()), 0x8140);
    EXPECT_EQ(told[0].data[2], error_generic | error_communication);
    EXPECT_EQ(load<std::uint16_t>(told[1].data.data()), 0);
    EXPECT_EQ(told[1].data[2], 0);
    EXPECT_EQ(node.device().emcy().error_register(), 0);
}

TEST(Faults, are_read_and_refused_with_what_to_type) {
    Fault fault{};
    FaultSetting s;
    std::string problem;
    ASSERT_TRUE(parse_fault("late-sdo:every=3:time=1.5ms:from=2s:for=500us", fault, s, problem));
    EXPECT_EQ(fault, Fault::late_sdo);
    EXPECT_EQ(s.every, 3U);
    EXPECT_EQ(s.time, 1500 * microsecond);
    EXPECT_EQ(s.from, 2 * second);
    EXPECT_EQ(s.until, 2 * second + 500 * microsecond);
    const std::pair<const char*, const char*> wrong[] = {
        {"mute:every=0",
         "invalid property 'every=0' of fault mute; write every=3, from=5s or for=1s"},
        {"mute:time=1ms",
         "invalid property 'time=1ms' of fault mute; write every=3, from=5s or for=1s"},
        {"late-sdo:time=1",
         "invalid property 'time=1' of fault late-sdo; write every=3, time=20ms, from=5s or "
         "for=1s"},
        {"late-sdo:late",
         "invalid property 'late' of fault late-sdo; write every=3, time=20ms, from=5s or for=1s"},
    };
    for (const auto& [text, said] : wrong) {
        EXPECT_FALSE(parse_fault(text, fault, s, problem));
        EXPECT_EQ(problem, said);
    }
    EXPECT_FALSE(parse_fault("", fault, s, problem));
    EXPECT_EQ(problem,
              "unknown fault ''; use one of: mute, deaf, twice, late-sdo, late-pdo, no-boot-up, "
              "boot-storm, reboot, no-heartbeat, "
              "wrong-state, guard-toggle, no-sdo, abort, stale-abort, toggle, block-gap, "
              "block-crc, short-pdo, long-pdo, wrong-type, "
              "wrong-vendor, wrong-product, wrong-revision, wrong-serial, wrong-software, babble, "
              "emcy-storm, "
              "no-srdo, srdo-half, srdo-wrong, srdo-order, late-srdo");
}

}  // namespace
}  // namespace hal::canopen::test
