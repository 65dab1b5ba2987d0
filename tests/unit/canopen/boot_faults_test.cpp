// SPDX-License-Identifier: MIT
// Every n-th frame lost, repeated or late, for a whole boot-up and an hour of plant time: the
// network ends operational or stopped with the reason, never stuck.
#include "boot_bed.hpp"

namespace hal::canopen::test {
namespace {

enum class Fault { lose, repeat, delay };

/// Two devices with PDOs on the SYNC, watched and watching, on a wire that spoils every n-th frame.
struct Plant : Bed {
    Plant(Fault fault, unsigned n, Reaction reaction)
        : Bed([&] {
              std::vector<NodeSetup> nodes;
              for (std::uint8_t id = 5; id <= 6; ++id) {
                  auto s = example_node(id);
                  s.heartbeat_ms = 1000;
                  s.heartbeat_limit = 3500 * millisecond;
                  s.master_limit_ms = 5000;
                  s.boot_limit = 60 * second;
                  s.retry = second;
                  s.retry_max = 5 * second;
                  s.on_failure = s.on_loss = reaction;
                  s.writes = {object_write(0x2000, 0, std::uint32_t{9}),
                              object_write(0x2001, 0, std::int16_t{-5})};
                  for (auto& w : tpdo_writes(
                           2, {.transmission = 1, .mapping = {map_entry(0x2000, 0, 32)}}, id)) {
                      s.writes.push_back(w);
                  }
                  nodes.push_back(s);
              }
              auto s = network_of(nodes);
              s.sdo = {.timeout = 500 * millisecond};
              return s;
          }()) {
        for (std::uint8_t id = 5; id <= 6; ++id) {
            add(id, example());
        }
        own->dictionary().set<std::uint16_t>(0x1017, 0, 1000);
        own->dictionary().set<std::uint32_t>(0x1006, 0, 2'000'000);
        own->dictionary().set<std::uint32_t>(0x1005, 0, 0x40000080);
        own->dictionary().keep(0x1000, 0x1fff, false);
        (fault == Fault::lose     ? bus.faults.lose
         : fault == Fault::repeat ? bus.faults.repeat
                                  : bus.faults.delay) = n;
        dt = 100 * millisecond;
    }
};

class BootFaults : public testing::TestWithParam<Fault> {};

TEST_P(BootFaults, Never_leave_the_network_stuck) {
    for (unsigned n = 2; n <= 50; ++n) {
        Plant b(GetParam(), n, Reaction::restart);
        b.power();
        b.start();
        Time max = 0;
        Time since = b.now;
        Time down = 0;
        auto step = b.status(5).step;
        for (const Time end = b.now + 3600 * second; b.now < end;) {
            b.step();
            if (b.status(5).step != step || b.status(5).step == Step::running) {
                step = b.status(5).step;
                since = b.now;
            }
            max = std::max(max, b.now - since);
            const auto& network = b.master->status();
            if (network.state == NetworkState::operational) continue;
            down += b.dt;
            ASSERT_NE(network.node, 0) << "every " << n;
        }
        EXPECT_LE(max, 30 * second) << "every " << n << ": " << to_string(step);
        // Only where question or answer is always hit may it be down for long.
        EXPECT_LE(down, (n > 4 ? 30 : 3600) * second)
            << "every " << n << ": " << b.master->sentence();
        EXPECT_EQ(b.master->sentence().find("node ") == std::string::npos,
                  b.master->status().state == NetworkState::operational);
        b.bus.faults = {};
        ASSERT_TRUE(b.operational(120 * second)) << "every " << n << ": " << b.master->sentence();
        for (std::size_t s = 0; s < 2; ++s) {
            EXPECT_EQ(b.value(s, 0x2000, 0), 9U);
        }
        EXPECT_EQ(b.value(0, 0x1801, 1) & ~cob_flag30, 0x285U);
    }
}

TEST_P(BootFaults, End_operational_or_stopped_with_the_reason) {
    for (unsigned n = 2; n <= 50; ++n) {
        Plant b(GetParam(), n, Reaction::reset_all);
        b.power();
        b.start();
        b.run(600 * second);
        const auto state = b.master->status().state;
        if (state == NetworkState::operational || state == NetworkState::degraded ||
            state == NetworkState::booting) {
            b.bus.faults = {};
            ASSERT_TRUE(b.until(
                [&] {
                return b.master->status().state == NetworkState::operational ||
                       b.master->status().state == NetworkState::failed;
            }, 300 * second))
                << "every " << n;
            continue;
        }
        ASSERT_EQ(state, NetworkState::failed) << "every " << n;
        EXPECT_NE(b.master->status().node, 0);
        EXPECT_NE(b.master->sentence().find("; all nodes were stopped"), std::string::npos)
            << b.master->sentence();
        b.run(10 * second);
        for (std::size_t s = 0; s < 2; ++s) {
            EXPECT_NE(b.state(s), NmtState::operational) << "every " << n;
        }
    }
}
std::string name_of(const testing::TestParamInfo<Fault>& with) {
    return with.param == Fault::lose ? "Lost" : with.param == Fault::repeat ? "Repeated" : "Late";
}
INSTANTIATE_TEST_SUITE_P(Each, BootFaults,
                         testing::Values(Fault::lose, Fault::repeat, Fault::delay), name_of);

}  // namespace
}  // namespace hal::canopen::test
