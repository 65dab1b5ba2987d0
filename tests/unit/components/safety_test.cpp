// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <string>

#include "unit/components/component_host.hpp"

namespace {

using hal::test::Instance;

// --- estop_latch, charge_pump ----------------------------------------------------------------------------------------

TEST(EstopLatch, Truth_table) {
    for (const bool was_ok : {false, true}) {
        for (const bool ok_in : {false, true}) {
            for (const bool fault_in : {false, true}) {
                for (const bool pressed : {false, true}) {
                    Instance latch("estop_latch");
                    if (was_ok) {
                        latch.set("reset", true);
                        latch.run(1);
                        latch.set("reset", false);

                        latch.run(1);
                    }
                    ASSERT_EQ(latch.get<bool>("ok-out"), was_ok);
                    latch.set("ok-in", ok_in);
                    latch.set("fault-in", fault_in);
                    latch.set("reset", pressed);
                    latch.run(1);
                    const bool ok = ok_in && !fault_in && (was_ok || pressed);
                    EXPECT_EQ(latch.get<bool>("ok-out"), ok);
                    EXPECT_EQ(latch.get<bool>("fault-out"), !ok);
                }
            }
        }
    }
}

TEST(EstopLatch, Resets_only_on_a_rising_edge_without_fault) {
    Instance latch("estop_latch");
    latch.set("fault-in", true);
    latch.set("reset", true);
    latch.run(2);
    latch.set("fault-in", false);
    latch.run(2);
    EXPECT_FALSE(latch.get<bool>("ok-out"));  // held since before
    latch.set("reset", false);
    latch.run(1);
    latch.set("reset", true);
    latch.run(1);
    EXPECT_TRUE(latch.get<bool>("ok-out"));
}

TEST(EstopLatch, Watchdog_changes_every_cycle_while_ok_only) {
    Instance latch("estop_latch");
    latch.run(3);
    EXPECT_FALSE(latch.get<bool>("watchdog"));
    latch.set("reset", true);
    for (int i = 0; i < 6; ++i) {
        const bool before = latch.get<bool>("watchdog");
        latch.run(1);
        EXPECT_NE(latch.get<bool>("watchdog"), before);
    }
}

TEST(ChargePump, Waves_have_half_a_quarter_and_an_eighth_of_the_rate) {
    Instance pump("charge_pump");
    std::string out, half, quarter;
    for (int i = 0; i < 16; ++i) {
        pump.run(1);
        out += pump.get<bool>("out") ? '1' : '0';
        half += pump.get<bool>("out-2") ? '1' : '0';
        quarter += pump.get<bool>("out-4") ? '1' : '0';
    }
    EXPECT_EQ(out, "1010101010101010");
    EXPECT_EQ(half, "0110011001100110");
    EXPECT_EQ(quarter, "0001111000011110");
    pump.set("enable", false);
    pump.run(1);
    EXPECT_FALSE(pump.get<bool>("out") || pump.get<bool>("out-2") || pump.get<bool>("out-4"));
}

// --- watchdog --------------------------------------------------------------------------------------------------------

TEST(Watchdog, Trips_when_an_input_times_out_and_stays_tripped) {
    Instance dog("watchdog", {{"num_inputs", "2"}});
    dog.set("timeout-0", 0.005);
    dog.set("timeout-1", 0.010);
    dog.set("enable-in", true);
    dog.run("process");  // before the limits are known: not well, and the start is not lost
    EXPECT_FALSE(dog.get<bool>("ok-out"));
    dog.run("set-timeouts");
    bool level = false;
    for (int i = 0; i < 100; ++i) {
        if (i % 4 == 0) {
            level = !level;
        }
        dog.set("input-0", level);
        dog.set("input-1", level);
        dog.run("process");
        ASSERT_TRUE(dog.get<bool>("ok-out")) << i;
    }
    dog.set("input-0", !level);
    dog.run("process");  // this change counts; from now on silence
    dog.run("process", 1'000'000, 5);  // exactly the timeout
    EXPECT_TRUE(dog.get<bool>("ok-out"));
    dog.run("process");
    EXPECT_FALSE(dog.get<bool>("ok-out"));
    EXPECT_EQ(dog.get<std::int32_t>("tripped-by"), 0);
    dog.set("input-0", level);
    dog.run("process");
    EXPECT_FALSE(dog.get<bool>("ok-out"));
    dog.set("enable-in", false);
    dog.run("process");
    dog.set("enable-in", true);
    dog.run("process");
    EXPECT_TRUE(dog.get<bool>("ok-out"));
    EXPECT_EQ(dog.get<std::int32_t>("tripped-by"), -1);
}

TEST(Watchdog, Each_input_has_its_own_timeout) {
    Instance dog("watchdog", {{"num_inputs", "2"}});
    dog.set("timeout-0", 1.0);
    dog.set("timeout-1", 0.003);
    dog.set("enable-in", true);
    dog.run("set-timeouts");
    dog.run("process", 1'000'000, 4);  // the first one begins
    EXPECT_TRUE(dog.get<bool>("ok-out"));
    dog.run("process");
    EXPECT_FALSE(dog.get<bool>("ok-out"));
    EXPECT_EQ(dog.get<std::int32_t>("tripped-by"), 1);
}

TEST(Watchdog, Without_a_timeout_or_disabled_never_reports_ok) {
    Instance dog("watchdog");
    dog.run("set-timeouts");
    dog.set("enable-in", true);
    dog.run("process");
    EXPECT_FALSE(dog.get<bool>("ok-out"));
    Instance off("watchdog");
    off.set("timeout-0", 1.0);
    off.run("set-timeouts");
    off.run("process");
    EXPECT_FALSE(off.get<bool>("ok-out"));
}

// --- faults ----------------------------------------------------------------------------------------------------------

TEST(Faults, Shows_the_record_and_acknowledges_it) {
    static hal_faults record{};
    record.size = sizeof record;
    record.clear = [](const hal_faults* r) { const_cast<hal_faults*>(r)->cleared = r->count; };
    Instance faults("faults", {}, {{"hal.faults/1", &record}});
    faults.run(1);
    EXPECT_TRUE(faults.get<bool>("ok"));
    record.count = 3;
    record.last_code = HAL_FAULT_NOT_FINITE;
    record.last_cycle = 1234;
    faults.run(1);
    EXPECT_FALSE(faults.get<bool>("ok"));
    EXPECT_TRUE(faults.get<bool>("active"));
    EXPECT_EQ(faults.get<std::uint64_t>("count"), 3u);
    EXPECT_EQ(faults.get<std::uint32_t>("last-code"), 2u);
    EXPECT_EQ(faults.get<std::uint64_t>("last-cycle"), 1234u);
    faults.set("reset", true);
    faults.run(1);
    EXPECT_TRUE(faults.get<bool>("ok"));
    record.count = 4;
    faults.run(2);  // a reset that is held acknowledges nothing new
    EXPECT_TRUE(faults.get<bool>("active"));
    EXPECT_THROW(Instance("faults"), std::runtime_error);
}

}  // namespace
