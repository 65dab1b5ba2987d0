// SPDX-License-Identifier: MIT
// The [bus] settings for SYNC following and for several masters.
#include <gtest/gtest.h>

#include "canopen/master/config/bus_schedule.hpp"

namespace hal::canopen::config {
namespace {

ReadResult read_bus(const std::string& lines) {
    return read("[bus]\n" + lines + "[node 5 x]\ndevice = cia401\n", "test.canopen",
                [](const std::string&, std::string&) { return false; });
}

std::vector<std::string> errors_of(const std::string& lines) {
    std::vector<std::string> found;
    for (const Message& m : read_bus(lines).messages) {
        if (m.severity == Severity::error) {
            found.push_back(std::to_string(m.at.line) + ": " + m.sentence);
        }
    }
    return found;
}

using Errors = std::vector<std::string>;

TEST(ConfigMasters, One_that_follows_takes_its_phase_and_may_keep_its_own_clock) {
    const ReadResult led = read_bus("sync = follow 2ms\nsync-phase = 300us\n");
    ASSERT_TRUE(led.good());
    EXPECT_TRUE(led.config.sync_clock);
    EXPECT_EQ(led.config.sync_phase, 300 * microsecond);
    EXPECT_FALSE(read_bus("sync = follow\nclock = own\n").config.sync_clock);
    EXPECT_EQ(errors_of("sync = cycle\nclock = sync\n"),
              (Errors{"3: 'clock' applies only when the master follows the SYNC of another node"}));
}

TEST(ConfigMasters, A_flying_master_has_the_times_of_its_keys) {
    const ReadResult r = read_bus(
        "flying-master = low\nnode-id = 9\nheartbeat = 20ms\nflying-delay = 1s\nflying-detect = "
        "2s\n");
    ASSERT_TRUE(r.good());
    const FlyingSetup& f = r.config.flying;
    EXPECT_TRUE(f.enabled);
    EXPECT_EQ(f.id, 9);
    EXPECT_EQ(f.priority, 2);
    EXPECT_EQ(f.delay, second);
    EXPECT_EQ(f.silence, 50 * millisecond);
    EXPECT_EQ(f.search_interval(), 2 * second);
    const Schedule schedule = schedule_of(r.config, millisecond);
    EXPECT_TRUE(std::any_of(schedule.messages.begin(), schedule.messages.end(),
                            [](const auto& m) { return m.id == 0x71; }));
}

TEST(ConfigMasters, What_cannot_be_of_several_masters_is_said_at_its_place) {
    EXPECT_EQ(errors_of("flying-timeout = 5ms\n"),
              (Errors{"2: 'flying-timeout' applies to flying masters only"}));
    EXPECT_EQ(errors_of("flying-master = best\nflying-timeout = 5ms\n"),
              (Errors{"2: invalid flying-master 'best'"}));
    EXPECT_EQ(
        errors_of("flying-master = low\nheartbeat = none\n"),
        (Errors{"2: a flying master needs a heartbeat: without one, its loss goes undetected"}));
    EXPECT_EQ(errors_of("flying-master = low\nflying-priority-slot = 1270ms\n").size(), 1u);
}

}  // namespace
}  // namespace hal::canopen::config
