// SPDX-License-Identifier: MIT
// The master on the simulated bus: its behaviour when the link does not accept its frames.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <vector>

#include "canopen/device/drive/drive_program.hpp"
#include "canopen/device/node.hpp"
#include "canopen/master/config/master_config.hpp"
#include "canopen/master/cycle/runner.hpp"
#include "link/simulation.hpp"

namespace hal::canopen::test {
namespace {

const std::string one_axis =
    "[bus]\nlink = sim:runner-wire\nbitrate = 1M\nsync = cycle\n"
    "[node 2 x]\ndevice = cia402\ntpdo1 = statusword\nrpdo1 = controlword, target-position\n";

/// A link that may take no frames, as one that another thread uses at the moment.
struct BusyLink final : can::Link {
    explicit BusyLink(can::Link& behind_) : behind(behind_) {}
    can::Sent send(const Frame& f, std::int64_t now) noexcept override {
        return busy ? can::Sent::full : behind.send(f, now);
    }
    void flush(std::int64_t now) noexcept override { behind.flush(now); }
    std::size_t receive(std::span<Frame> frames, std::int64_t now) noexcept override {
        return busy ? 0 : behind.receive(frames, now);
    }
    can::Statistics statistics() const noexcept override { return behind.statistics(); }
    can::State state() const noexcept override { return behind.state(); }
    bool set_filters(std::span<const can::Filter> filters) override {
        return behind.set_filters(filters);
    }
    const can::Description& description() const noexcept override { return behind.description(); }
    bool wait(std::int64_t at_most) override { return behind.wait(at_most); }

    can::Link& behind;
    bool busy = false;
};

struct Wire : Events {
    explicit Wire(const std::string& more = "", bool starts_itself = false,
                  const std::string& axis = one_axis)
        : reading(config::read(axis + more, "x.canopen")),
          runner(reading.config, *this),
          link(open()),
          ear(open()),
          drive(settings()) {
        EXPECT_TRUE(reading.good());
        node = std::make_unique<Node>(drive, open(),
                                      DeviceSettings{.node_id = 2, .auto_start = starts_itself});
        runner.attach(*link);
        for (Slot& s : runner.slots()) {
            if (s.to_node && s.object->bits == 32) {
                target = &s;
            }
        }
    }
    static std::unique_ptr<can::Link> open() {
        auto opened = can::open("sim:runner-wire", {.bit_rate = 1'000'000, .send_capacity = 4096});
        EXPECT_TRUE(opened) << opened.problem;
        return std::move(opened.link);
    }
    static DriveSettings settings() {
        DriveSettings s;
        s.axes = 1;
        return s;
    }
    /// A cycle, whose set-point is its number; what others hear of it is kept.
    void step() {
        now += millisecond;
        if (!number_stands) {
            ++number;
        }
        runner.receive(now);
        if (target != nullptr) {
            target->output = static_cast<std::uint64_t>(number);
        }
        runner.transmit(now, millisecond);
        node->turn(now);
        for (Frame f; ear->receive(f, now);) {
            if (f.id == 0x282) {
                ++(f.remote ? asked : answered);
            }
            if (f.id == 0x080) {
                ++syncs;
            }
            if (f.id == 0x202) {
                ++rpdos;
            }
            if (f.id != 0x202 || f.length != 6) continue;
            std::int32_t value = 0;
            std::memcpy(&value, f.data.data() + 2, sizeof value);
            if (value != 0) {
                heard.push_back(value);
            }
        }
    }
    /// Others keep the bus for `cycles`: twelve frames of eight bytes take longer than a
    /// millisecond.
    void flood(int cycles) {
        for (; cycles > 0; --cycles, step()) {
            for (int n = 0; n < 12; ++n) {
                ear->send({0x001, {1, 2, 3, 4, 5, 6, 7, 8}}, now);
            }
            ear->flush(now);
        }
    }
    void on_sync_overrun() noexcept override { ++overruns; }
    void on_own_id_collision() noexcept override { ++own_id_taken; }
    void on_short(std::size_t position, unsigned bytes) noexcept override {
        cut.emplace_back(position, bytes);
    }

    void on_foreign(const Foreign& f) noexcept override { foreign.push_back(f); }

    unsigned overruns = 0;
    unsigned own_id_taken = 0;
    unsigned asked = 0;
    unsigned answered = 0;
    unsigned syncs = 0;
    unsigned rpdos = 0;
    std::vector<Foreign> foreign;
    std::vector<std::pair<std::size_t, unsigned>> cut;
    config::ReadResult reading;
    Runner runner;
    std::unique_ptr<can::Link> link, ear;
    DriveProgram drive;
    std::unique_ptr<Node> node;
    Slot* target = nullptr;
    Time now = second;
    std::int32_t number = 0;
    bool number_stands = false;
    std::vector<std::int32_t> heard;
};

TEST(Runner, Counts_the_syncs_that_are_due_before_what_belongs_to_the_last_is_sent) {
    Wire w;
    for (int n = 0; n < 5000 && !w.runner.operational(0); ++n) {
        w.step();
    }
    ASSERT_TRUE(w.runner.operational(0));
    for (int n = 0; n < 100; ++n) {
        w.step();
    }
    EXPECT_EQ(w.runner.sync_overruns(), 0U);
    w.flood(5);
    EXPECT_GE(w.runner.sync_overruns(), 3U);
    for (int n = 0; n < 20; ++n) {
        w.step();
    }
    const auto overruns = w.runner.sync_overruns();
    EXPECT_EQ(w.overruns, overruns);
    for (int n = 0; n < 100; ++n) {
        w.step();
    }
    EXPECT_EQ(w.runner.sync_overruns(), overruns);
    EXPECT_TRUE(w.runner.operational(0));
}

TEST(Runner, Tells_a_PDO_that_is_too_short_once_until_a_whole_one_comes) {
    Wire w;
    for (int n = 0; n < 5000 && !w.runner.operational(0); ++n) {
        w.step();
    }
    ASSERT_TRUE(w.runner.operational(0));
    for (int n = 0; n < 10; ++n) {
        w.step();
    }
    const auto value = [&] {
        for (const Slot& s : w.runner.slots()) {
            if (!s.to_node) return Dictionary::value<std::uint64_t>(*s.entry);
        }
        return std::uint64_t{0};
    };
    const std::uint64_t before = value();
    EXPECT_NE(before, 0U);
    w.node->faults().set(Fault::short_pdo, {.every = 1});
    for (int n = 0; n < 10; ++n) {
        w.step();
    }
    EXPECT_EQ(w.cut, (std::vector<std::pair<std::size_t, unsigned>>{{0, 1}}));
    EXPECT_EQ(value(), before);
    w.node->faults().set(Fault::short_pdo, {});
    for (int n = 0; n < 10; ++n) {
        w.step();
    }
    w.node->faults().set(Fault::short_pdo, {.every = 1});
    for (int n = 0; n < 10; ++n) {
        w.step();
    }
    EXPECT_EQ(w.cut.size(), 2U);
}

TEST(Runner, Notices_another_device_with_the_master_s_node_id) {
    Wire w;
    for (int n = 0; n < 300; ++n) {
        w.step();
    }
    EXPECT_EQ(w.own_id_taken, 0U);
    w.ear->send({0x77f, {0x05}}, w.now);
    w.ear->flush(w.now);
    for (int n = 0; n < 3; ++n) {
        w.step();
    }
    EXPECT_EQ(w.own_id_taken, 1U);
}

/// CiA 302-2. The drive starts by itself, with RPDO 1 and TPDO 1 laid out otherwise.
TEST(Runner, Sends_and_takes_no_process_data_before_a_node_is_configured) {
    for (const bool at_boot : {false, true}) {
        std::string bus = one_axis;
        if (at_boot) {
            bus.insert(bus.find("[node"), "sync-at-boot = yes\n");
        }
        Wire w("tpdo1 = statusword, modes-of-operation-display\n", true,
               bus.substr(0, bus.find("tpdo1")) + bus.substr(bus.find("rpdo1")));
        for (int n = 0; n < 5000 && w.runner.status(0).step < Step::watching; ++n) {
            w.step();
            if (w.runner.status(0).step >= Step::watching) break;
            ASSERT_EQ(w.rpdos, 0U);
            if (!at_boot) {
                ASSERT_EQ(w.syncs, 0U);
            }
        }
        EXPECT_EQ(w.syncs > 0, at_boot);
        for (int n = 0; n < 5000 && !w.runner.operational(0); ++n) {
            w.step();
        }
        for (int n = 0; n < 20; ++n) {
            w.step();
        }
        EXPECT_TRUE(w.runner.operational(0));
        EXPECT_GE(w.rpdos, 18U);
        EXPECT_GE(w.syncs, 18U);
        EXPECT_TRUE(w.cut.empty())
            << "a different PDO mapping before the configuration does not count as a fault";

        // The node loses power and restarts with its default mapping.
        w.node->power(false);
        for (int n = 0; n < 10; ++n) {
            w.step();
        }
        w.node->power(true);
        for (int n = 0; n < 5000 && w.runner.operational(0); ++n) {
            w.step();
        }
        bool booting = false;
        for (int n = 0; n < 5000 && !w.runner.operational(0); ++n) {
            w.step();
            const Step step = w.runner.status(0).step;
            if (!booting && step < Step::watching) {
                booting = true;
                w.rpdos = 0;
            }
            if (booting && step < Step::watching) {
                ASSERT_LE(w.rpdos, 1U) << "one was on its way";
            }
        }
        EXPECT_TRUE(booting);
        EXPECT_TRUE(w.cut.empty());
    }
}

TEST(Runner, Names_what_others_send_in_its_place_once_a_second) {
    Wire w;
    for (int n = 0; n < 5000 && !w.runner.operational(0); ++n) {
        w.step();
    }
    ASSERT_TRUE(w.runner.operational(0));
    EXPECT_TRUE(w.foreign.empty());
    const auto send = [&](const Frame& f) {
        w.ear->send(f, w.now + millisecond / 2);
        w.ear->flush(w.now + millisecond / 2);
    };
    for (int n = 0; n < 2500; ++n) {
        send({0x080, {}});
        w.step();
    }
    ASSERT_EQ(w.foreign.size(), 3U);
    EXPECT_TRUE(w.foreign[0].begins && w.foreign[0].sync);
    EXPECT_EQ(w.foreign[0].frames, 1U);
    EXPECT_FALSE(w.foreign[1].begins);
    EXPECT_NEAR(w.foreign[1].frames, 1000, 2);
    for (int n = 0; n < 1100; ++n) {
        w.step();
    }
    w.foreign.clear();
    send({0x080, {}});
    send({0x202, {1, 2, 3, 4, 5, 6}});

    send({0x602, {0x40, 0, 0x10, 0, 0, 0, 0, 0}});
    send({0x000, {0x80, 7}});
    send({0x201, {1}});
    send({0x182, {1, 2}});
    for (int n = 0; n < 3; ++n) {
        w.step();
    }
    ASSERT_EQ(w.foreign.size(), 4U);
    EXPECT_TRUE(std::all_of(w.foreign.begin(), w.foreign.end(),
                            [](const auto& f) { return f.begins && f.frames == 1; }));
    std::sort(w.foreign.begin(), w.foreign.end(),
              [](const auto& a, const auto& b) { return a.id < b.id; });
    EXPECT_EQ(w.foreign[0].id, 0x000);
    EXPECT_EQ(w.foreign[0].data, (std::array<std::uint8_t, 2>{0x80, 7}));
    EXPECT_TRUE(w.foreign[1].sync && w.foreign[1].id == 0x080);
    EXPECT_TRUE(w.foreign[2].rpdo && w.foreign[2].id == 0x202);
    EXPECT_EQ(w.foreign[3].id, 0x602);
}

TEST(Runner, Set_points_that_a_dead_wire_kept_back_are_not_sent_when_it_is_back) {
    Wire w;
    ASSERT_NE(w.target, nullptr);
    for (int n = 0; n < 5000 && !w.runner.operational(0); ++n) {
        w.step();
    }
    ASSERT_TRUE(w.runner.operational(0));
    for (int n = 0; n < 100; ++n) {
        w.step();
    }
    ASSERT_GE(w.heard.size(), 90U);
    EXPECT_LE(w.number - w.heard.back(), 2);

    auto* simulation = w.link->simulation();
    simulation->cut(simulation->node(), true);  // the master's own plug
    for (int n = 0; n < 100; ++n) {
        w.step();  // too short for the node to count as lost
    }
    EXPECT_GT(w.runner.withheld(), 140U);    // SYNC and set-point of 80 cycles, but for a few

    w.heard.clear();
    const auto last_of_before = w.number;
    simulation->cut(simulation->node(), false);
    for (int n = 0; n < 100; ++n) {
        w.step();
    }
    const auto old = std::count_if(w.heard.begin(), w.heard.end(),
                                   [&](std::int32_t value) { return value <= last_of_before; });
    EXPECT_LE(old, 22);  // what was on its way when it was noticed: 20 ms
    EXPECT_GE(w.heard.size(), 90U);
    EXPECT_LE(w.number - w.heard.back(), 2);
}

TEST(Runner, Asks_for_what_a_node_sends_on_request_as_often_as_it_is_told_to) {
    Wire w("tpdo2 = modes-of-operation-display\ntpdo2.request = 10ms\n");
    for (int n = 0; n < 5000 && !w.runner.operational(0); ++n) {
        w.step();
    }
    ASSERT_TRUE(w.runner.operational(0));
    for (int n = 0; n < 10; ++n) {
        w.step();
    }
    w.asked = w.answered = 0;
    for (int n = 0; n < 200; ++n) {
        w.step();
    }
    EXPECT_EQ(w.asked, 20U);
    EXPECT_EQ(w.answered, 20U);
    w.node->power(false);
    for (int n = 0; n < 1000; ++n) {
        w.step();
    }
    w.asked = 0;
    for (int n = 0; n < 100; ++n) {
        w.step();
    }
    EXPECT_EQ(w.asked, 0U);
}

TEST(Runner, What_is_sent_on_a_change_is_sent_again_when_a_dead_wire_is_back) {
    Wire w("rpdo1.transmission = event\n");
    for (int n = 0; n < 5000 && !w.runner.operational(0); ++n) {
        w.step();
    }
    ASSERT_TRUE(w.runner.operational(0));
    for (int n = 0; n < 20; ++n) {
        w.step();
    }
    auto* simulation = w.link->simulation();
    simulation->cut(simulation->node(), true);
    for (int n = 0; n < 80; ++n) {
        w.step();
    }
    const std::int32_t last = w.number;
    w.number_stands = true;  // it changes no more: nothing else would send it
    for (int n = 0; n < 20; ++n) {
        w.step();
    }
    w.heard.clear();
    simulation->cut(simulation->node(), false);
    for (int n = 0; n < 50; ++n) {
        w.step();
    }
    ASSERT_FALSE(w.heard.empty());
    EXPECT_EQ(w.heard.back(), last);
}

TEST(Runner, Safe_values_that_the_link_did_not_take_are_sent_with_the_next_call) {
    Wire w;
    BusyLink busy(*w.link);
    w.runner.attach(busy);
    for (int n = 0; n < 5000 && !w.runner.operational(0); ++n) {
        w.step();
    }
    ASSERT_TRUE(w.runner.operational(0));
    unsigned farewells = 0;
    unsigned set_points = 0;
    const auto listen = [&] {
        w.now += millisecond;
        w.link->flush(w.now);
        for (Frame f; w.ear->receive(f, w.now);) {
            farewells += f.id == 0 && f.data[0] == 0x80 && f.data[1] == 2 ? 1 : 0;
            set_points += f.id == 0x202 ? 1 : 0;
        }
    };
    listen();
    farewells = set_points = 0;
    busy.busy = true;
    w.runner.make_safe();  // by a thread that finds the link in use
    busy.busy = false;
    listen();
    EXPECT_EQ(farewells, 0U);
    w.runner.make_safe();  // by the thread that used it, at the end of its cycle
    w.runner.make_safe();
    listen();
    EXPECT_EQ(farewells, 1U);
    EXPECT_EQ(set_points, 1U);
    for (int n = 0; n < 5000 && !w.runner.operational(0); ++n) {
        w.step();
    }
    EXPECT_TRUE(w.runner.operational(0)) << "it boots the network again";
}

TEST(Runner, What_came_while_no_cycles_ran_is_dropped) {
    Wire w;
    for (int n = 0; n < 5000 && !w.runner.operational(0); ++n) {
        w.step();
    }
    ASSERT_TRUE(w.runner.operational(0));
    w.runner.make_safe();
    w.now += second;
    for (int n = 0; n < 200; ++n) {
        w.ear->send({0x182, {0x37, 0x02}}, w.now);  // old statusword
    }
    w.now += second;
    w.node->turn(w.now);
    w.runner.receive(w.now);
    for (const Slot& s : w.runner.slots()) {
        if (!s.to_node) {
            EXPECT_NE(Dictionary::value<std::uint64_t>(*s.entry), 0x0237U);
        }
    }
    for (int n = 0; n < 5000 && !w.runner.operational(0); ++n) {
        w.step();
    }
    EXPECT_TRUE(w.runner.operational(0));
}

struct RunnerRestart : testing::TestWithParam<Time> {};

TEST_P(RunnerRestart, Is_operational_again_whenever_the_boot_before_was_stopped) {
    constexpr int limit = 30'000;
    Wire w;
    w.node->faults().set(Fault::late_sdo, {.every = GetParam() != 0 ? 1U : 0U, .time = GetParam()});
    const auto boot = [&] {
        int cycles = 0;
        while (cycles < limit && !w.runner.operational(0)) {
            w.step();
            ++cycles;
        }
        return cycles;
    };
    const auto stop = [&] {
        w.runner.make_safe();
        for (int n = 0; n < 10; ++n) {  // the node goes on
            w.now += millisecond;
            w.node->turn(w.now);
        }
        w.runner.receive(w.now);  // the cycle that begins anew
    };
    ASSERT_LT(boot(), limit);
    stop();
    const int usual = boot();
    ASSERT_GT(usual, 0);
    ASSERT_LT(usual, limit);
    int after = 1;
    while (after <= usual) {
        stop();
        for (int n = 0; n < after; ++n) {
            w.step();
        }
        stop();
        ASSERT_LE(boot(), usual + 1'000) << "stopped " << after << " ms after the start";
        after += after < 60 ? 1 : 1 + usual / 50;
    }
}

INSTANTIATE_TEST_SUITE_P(LateAnswers, RunnerRestart,
                         testing::Values(0, 5 * millisecond, 20 * millisecond, 100 * millisecond));

}  // namespace
}  // namespace hal::canopen::test
