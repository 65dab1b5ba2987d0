// SPDX-License-Identifier: MIT
// The master at work on the bus in memory: what it does when the wire does not take what it has to say.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <vector>

#include "canopen/config/config.hpp"
#include "canopen/devices/drive.hpp"
#include "canopen/devices/node.hpp"
#include "canopen/master/runner.hpp"
#include "link/simulation.hpp"

namespace hal::canopen::test {
namespace {

constexpr const char* one_axis =
    "[bus]\nlink = sim:runner-wire\nbitrate = 1M\nsync = cycle\n"
    "[node 2 x]\ndevice = cia402\ntpdo1 = statusword\nrpdo1 = controlword, target-position\n";

struct Wire : RunnerEvents {
    Wire() : reading(config::read(one_axis, "x.canopen")), runner(reading.config, *this), link(open()), ear(open()), drive(settings()) {
        EXPECT_TRUE(reading.good());
        node = std::make_unique<Node>(drive, open(), DeviceSettings{.node_id = 2});
        runner.open(*link);
        for (Slot& s : runner.slots())
            if (s.to_node && s.object->bits == 32) target = &s;
    }
    static std::unique_ptr<can::Link> open() {
        auto opened = can::open("sim:runner-wire", {.bit_rate = 1'000'000, .send_capacity = 4096});
        EXPECT_TRUE(opened) << opened.problem;
        return std::move(opened.link);
    }
    static cia402::DriveSettings settings() {
        cia402::DriveSettings s;
        s.axes = 1;
        return s;
    }
    /// A cycle, whose set-point is its number; what others hear of it is kept.
    void step() {
        now += millisecond;
        ++number;
        runner.receive(now);
        if (target != nullptr) target->wish = static_cast<std::uint64_t>(number);
        runner.transmit(now, millisecond);
        node->turn(now);
        for (Frame f; ear->receive(f, now);) {
            if (f.id != 0x202 || f.length != 6) continue;
            std::int32_t value = 0;
            std::memcpy(&value, f.data.data() + 2, sizeof value);
            if (value != 0) heard.push_back(value);
        }
    }
    config::Reading            reading;
    Runner                     runner;
    std::unique_ptr<can::Link> link, ear;
    DriveProgram               drive;
    std::unique_ptr<Node>      node;
    Slot*                      target = nullptr;
    Time                       now = second;
    std::int32_t               number = 0;
    std::vector<std::int32_t>  heard;
};

TEST(Runner, Set_points_that_a_dead_wire_kept_back_are_not_sent_when_it_is_back) {
    Wire w;
    ASSERT_NE(w.target, nullptr);
    for (int n = 0; n < 5000 && !w.runner.operational(0); ++n) w.step();
    ASSERT_TRUE(w.runner.operational(0));
    for (int n = 0; n < 100; ++n) w.step();
    ASSERT_GE(w.heard.size(), 90U);
    EXPECT_LE(w.number - w.heard.back(), 2);

    auto* simulation = w.link->simulation();
    simulation->cut(simulation->node(), true);  // the master's own plug
    for (int n = 0; n < 100; ++n) w.step();  // not so long that the node counts as lost
    EXPECT_GT(w.runner.withheld(), 140U);    // SYNC and set-point of 80 cycles, but for a few

    w.heard.clear();
    const auto last_of_before = w.number;
    simulation->cut(simulation->node(), false);
    for (int n = 0; n < 100; ++n) w.step();
    const auto old = std::count_if(w.heard.begin(), w.heard.end(), [&](std::int32_t value) { return value <= last_of_before; });
    EXPECT_LE(old, 22);  // what was on its way when it was noticed: 20 ms
    EXPECT_GE(w.heard.size(), 90U);
    EXPECT_LE(w.number - w.heard.back(), 2);
}

}  // namespace
}  // namespace hal::canopen::test
