// SPDX-License-Identifier: MIT
// Booting on the bus in memory, where frames take their time and the lowest identifier wins: a full
// network, and a disturbed one.
#include <gtest/gtest.h>
#include <time.h>

#include <array>
#include <cstdio>
#include <memory>

#include "canopen/master/boot/nmt_master.hpp"
#include "canopen/protocol/device.hpp"
#include "link/simulation.hpp"

namespace hal::canopen::test {
namespace {

struct OnBus : MasterEvents {
    OnBus(const std::string& bus, const MasterSetup& setup,
          const std::function<Description(std::uint8_t)>& device)
        : own(basic_device({.heartbeat_ms = 100}), {.node_id = setup.id, .nmt_slave = false},
              own_events),
          master(setup, own.out(), *this),
          link(open(bus)) {
        for (const auto& n : setup.nodes) {
            nodes.push_back(std::make_unique<Node>(n.id, device(n.id), open(bus)));
            const can::Filter filters[] = {// as a controller has
                                           {n.id, 0x7f, false},
                                           {0, 0x77f, false},
                                           {setup.id + 0x700U, 0x7ff, false}};
            EXPECT_TRUE(nodes.back()->link->set_filters(filters));
        }
    }
    static std::unique_ptr<can::Link> open(const std::string& bus) {
        auto opened = can::open(bus, {.send_capacity = 512, .receive_capacity = 512});
        EXPECT_TRUE(opened) << opened.problem;
        return std::move(opened.link);
    }
    struct Node : DeviceEvents {
        Node(std::uint8_t id, const Description& d, std::unique_ptr<can::Link> l)
            : device(d, {.node_id = id, .queue = 64}, *this), link(std::move(l)) {}
        Device device;
        std::unique_ptr<can::Link> link;
    };
    static void flow(FrameQueue& out, can::Link& link, Time now) {
        for (const Frame* f;
             (f = out.front()) != nullptr && link.send(*f, now) == can::Sent::queued;) {
            out.drop();
        }
        link.flush(now);
    }
    void start() {
        for (auto& n : nodes) {
            n->device.start(now);
            flow(n->device.out(), *n->link, now);
        }
        own.start(now);
        master.start(now);
    }
    void step() {
        now += dt;
        for (Frame f; link->receive(f, now);) {
            own.handle(f, now);
            master.handle(f, now);
        }
        own.poll(now);
        master.poll(now);
        flow(own.out(), *link, now);
        for (auto& n : nodes) {
            for (Frame f; n->link->receive(f, now);) {
                n->device.handle(f, now);
            }
            n->device.poll(now);
            flow(n->device.out(), *n->link, now);
        }
    }
    bool until_operational(Time at_most) {
        for (const Time end = now + at_most;
             now < end && master.status().state != NetworkState::operational;) {
            step();
        }
        return master.status().state == NetworkState::operational;
    }
    void on_own_state(NmtState s) noexcept override {
        own.command(
            s == NmtState::operational ? NmtCommand::start : NmtCommand::enter_pre_operational,
            now);
    }
    Time now = second;
    Time dt = 100 * microsecond;
    DeviceEvents own_events;
    Device own;
    Master master;
    std::unique_ptr<can::Link> link;
    std::vector<std::unique_ptr<Node>> nodes;
};

Description device_with(unsigned objects, std::uint8_t id) {
    auto d = basic_device(
        {.device_type = 0x191, .vendor = 1, .product = 2, .revision = 3, .serial = id});
    d.add(0x2000, 0, Type::unsigned8, Access::constant, objects);
    for (unsigned n = 1; n <= objects; ++n) {
        d.add(0x2000, static_cast<std::uint8_t>(n), Type::unsigned32, Access::read_write, 0);
    }
    return d;
}
NodeSetup node_with(unsigned objects, std::uint8_t id) {
    NodeSetup n;
    n.id = id;
    n.device_type = 0x191;
    n.vendor = 1;
    n.product = 2;
    n.revision = 3;
    n.serial = id;
    for (unsigned o = 1; o <= objects; ++o) {
        n.writes.push_back(
            object_write(0x2000, static_cast<std::uint8_t>(o), std::uint32_t{o * 1000 + id}));
    }
    return n;
}
double cpu_s() {
    timespec t{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + static_cast<double>(t.tv_nsec) * 1e-9;
}

TEST(BootBus, A_full_network_boots_in_parallel_at_1_Mbit) {
    MasterSetup setup;
    setup.id = 0;  // so that there are 127 others
    for (std::uint8_t id = 1; id <= 127; ++id) {
        setup.nodes.push_back(node_with(20, id));
        setup.nodes.back().heartbeat_ms = 500;
    }
    OnBus b("sim:boot-full?bitrate=1000000", setup,
            [](std::uint8_t id) { return device_with(20, id); });
    const auto cpu = cpu_s();
    b.start();
    ASSERT_TRUE(b.until_operational(60 * second)) << b.master.sentence();
    const auto took = b.now - second;
    std::printf(
        "127 nodes, identity and 20 objects each compared, written and verified, 1 Mbit/s: %.2f s "
        "of plant time, %.2f s of CPU "
        "(bus and all devices included)\n",
        static_cast<double>(took) / second, cpu_s() - cpu);
    unsigned retries = 0;
    for (auto& n : b.nodes) {
        const auto id = n->device.node_id();
        EXPECT_EQ(n->device.dictionary().get<std::uint32_t>(0x2000, 20), 20'000U + id);
        retries += static_cast<unsigned>(b.master.status(id).sdo_retries);
    }
    EXPECT_EQ(retries, 0U);
    EXPECT_EQ(b.own.out().rejected(), 0U);
    const auto frames = b.link->statistics().sent + b.link->statistics().received;
    // 5 identity reads, 20 times compare, write, verify and the same of 1017h: two frames each;
    // boot-up, heartbeat, start, a reset.
    EXPECT_NEAR(static_cast<double>(frames), 127.0 * (2 * (5 + 63) + 4), 127.0 * 30);
}

TEST(BootBus, Survives_errors_loss_repetition_and_delay_together) {
    for (const std::uint64_t seed : {1U, 2U, 3U, 4U, 5U, 6U, 7U, 8U}) {
        MasterSetup setup;
        setup.sdo.timeout = 100 * millisecond;
        for (std::uint8_t id = 1; id <= 3; ++id) {
            setup.nodes.push_back(node_with(10, id));
        }
        const auto bus = "sim:boot-disturbed-" + std::to_string(seed);
        OnBus b(bus, setup, [](std::uint8_t id) { return device_with(10, id); });
        auto* simulation = b.link->simulation();
        simulation->seed(seed);
        simulation->disturb({.fault = can::Fault::error, .probability = 0.02});
        simulation->disturb({.fault = can::Fault::loss, .probability = 0.02});
        simulation->disturb({.fault = can::Fault::duplicate, .probability = 0.05});
        simulation->disturb(
            {.fault = can::Fault::delay, .probability = 0.05, .delay_ns = 5 * millisecond});
        b.dt = 500 * microsecond;
        b.start();
        ASSERT_TRUE(b.until_operational(30 * second))
            << "seed " << seed << ": " << b.master.sentence();
        Time down = 0;
        for (const Time end = b.now + 60 * second; b.now < end;) {
            b.step();
            if (b.master.status().state != NetworkState::operational) {
                down += b.dt;
            }
        }
        EXPECT_LE(down, 20 * second) << "seed " << seed;
        // A node is disconnected and recovers without help.
        const auto node = b.nodes[1]->link->simulation()->node();
        simulation->cut(node, true);
        for (int n = 0; n < 4000; ++n) {
            b.step();
        }
        EXPECT_FALSE(b.master.status(2).operational);
        simulation->cut(node, false);
        simulation->calm();
        ASSERT_TRUE(b.until_operational(30 * second))
            << "seed " << seed << ": " << b.master.sentence();
        // The master's own wire.
        simulation->cut(simulation->node(), true);
        for (int n = 0; n < 4000; ++n) {
            b.step();
        }
        EXPECT_EQ(b.master.status().operational, 0);
        simulation->cut(simulation->node(), false);
        ASSERT_TRUE(b.until_operational(30 * second))
            << "seed " << seed << ": " << b.master.sentence();
    }
}

TEST(BootBus, Boots_beside_a_node_that_babbles) {
    MasterSetup setup;
    for (std::uint8_t id = 1; id <= 3; ++id) {
        setup.nodes.push_back(node_with(10, id));
    }
    OnBus b("sim:boot-babbling?bitrate=125000", setup,
            [](std::uint8_t id) { return device_with(10, id); });
    // four fifths of the bus
    b.nodes[0]->link->simulation()->babble({0x81, {0x10, 0x82, 1, 0, 0, 0, 0, 0}},
                                           1500 * microsecond);
    b.start();
    EXPECT_TRUE(b.until_operational(30 * second)) << b.master.sentence();
    EXPECT_GT(b.master.status(1).emergencies, 100U);
    // all of it
    b.nodes[0]->link->simulation()->babble({0x81, {0x10, 0x82, 1, 0, 0, 0, 0, 0}},
                                           900 * microsecond);
    for (int n = 0; n < 50'000; ++n) {
        b.step();
    }
    EXPECT_NE(b.master.status().state, NetworkState::operational);
    EXPECT_NE(b.master.sentence().find("node "), std::string::npos);
    b.nodes[0]->link->simulation()->calm();
    EXPECT_TRUE(b.until_operational(30 * second)) << b.master.sentence();
}

}  // namespace
}  // namespace hal::canopen::test
