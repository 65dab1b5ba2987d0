// SPDX-License-Identifier: MIT
// Nodes that are lost, reboot or leave the operational state, and how the master recovers them.
#include "boot_bed.hpp"

namespace hal::canopen::test {
namespace {

TEST(BootNetwork, Reboots_a_power_cycled_node_while_the_others_run) {
    Three b(
        [](std::uint8_t, NodeSetup& n) { n.writes = {object_write(0x2000, 0, std::uint32_t{9})}; });
    b.power();
    b.start();
    ASSERT_TRUE(b.operational());
    // A short power loss: only the boot-up message reveals it.
    b.stations[1]->plug(false, b.now);
    b.run(10 * millisecond);
    b.stations[1]->plug(true, b.now);
    EXPECT_EQ(b.value(1, 0x2000, 0), 0x12345678U);
    b.run(2 * millisecond);
    EXPECT_EQ(b.master->status().state, NetworkState::degraded);
    EXPECT_EQ(b.status(6).losses, 1U);
    ASSERT_TRUE(b.operational(second));
    EXPECT_EQ(b.value(1, 0x2000, 0), 9U);
    EXPECT_EQ(b.status(6).retries, 1U);
    // For long: its heartbeat is missed.
    b.stations[1]->plug(false, b.now);
    const auto off = b.now;
    ASSERT_TRUE(b.until([&] { return !b.status(6).online; }));
    EXPECT_LE(b.now - off, 125 * millisecond + 2 * b.dt);
    EXPECT_EQ(b.master->sentence(),
              "the network is degraded: node 6 sent no heartbeat within its timeout: check its "
              "power and cable; retrying");
    b.run(20 * second);
    b.stations[1]->plug(true, b.now);
    ASSERT_TRUE(b.operational(second));
    EXPECT_EQ(b.value(1, 0x2000, 0), 9U);
    for (const std::uint8_t other : {std::uint8_t{5}, std::uint8_t{7}}) {
        EXPECT_EQ(b.status(other).attempts, 1U);
        EXPECT_EQ(b.state(static_cast<std::size_t>(other) - 5), NmtState::operational);
    }
}

TEST(BootNetwork, Reboots_a_node_that_left_operational_or_was_unplugged) {
    Three b;
    b.power();
    b.start();
    ASSERT_TRUE(b.operational());
    b.stations[0]->device.command(NmtCommand::enter_pre_operational, b.now);
    ASSERT_TRUE(b.until([&] { return b.status(5).losses == 1; }, second));
    EXPECT_EQ(b.status(5).cause, Cause::left_operational);
    EXPECT_EQ(b.master->sentence(5),
              "node 5 left the operational state without a command from this master and is "
              "pre-operational: check "
              "the node, and the bus for another NMT master");
    ASSERT_TRUE(b.until([&] { return b.status(5).operational; }, second));
    // The cable: the device goes on as if nothing were.
    auto& s = *b.stations[2];
    s.powered = false;
    b.run(5 * second);
    EXPECT_FALSE(b.status(7).online);
    s.powered = true;
    EXPECT_TRUE(b.until([&] { return b.status(7).operational; }, second));
}

TEST(BootNetwork, Backs_off_from_a_node_that_reboots_repeatedly) {
    Three b;
    b.power();
    b.start();
    ASSERT_TRUE(b.operational());
    Frame boot_up = make_frame(0x706, 1);
    const auto attempts = b.status(6).attempts;
    const auto questions = b.bus.sent(0x606).size();
    b.stations[1]->delay = 4 * millisecond;  // no boot is over before the next of them
    for (int n = 0; n < 3000; ++n) {
        b.bus.inject(boot_up, b.now);
        b.run(10 * millisecond);
    }
    EXPECT_LE(b.status(6).attempts - attempts, 40U);
    EXPECT_LE(b.bus.sent(0x606).size() - questions, 40U * 9 * 6);
    EXPECT_EQ(b.status(6).cause, Cause::restarting);
    EXPECT_EQ(b.master->sentence(6).substr(0, 27), "node 6 rebooted repeatedly ");
    EXPECT_TRUE(b.status(5).operational && b.status(7).operational);
    EXPECT_TRUE(b.operational());  // as soon as it is over
}

TEST(BootNetwork, Boots_despite_repeated_and_missing_boot_up_messages) {
    Three b;
    b.stations[0]->tamper = [&](const Frame& f) {
        if (f.id == 0x705 && f.data[0] == 0) {
            b.stations[0]->wire.push(f);
            b.stations[0]->wire.push(f);
        }
        return true;
    };
    b.stations[1]->tamper = [](const Frame& f) { return f.id != 0x706 || f.data[0] != 0; };
    b.power();
    b.start();
    EXPECT_TRUE(b.operational(3 * second));
    EXPECT_GE(b.status(5).boot_ups, 3U);
    EXPECT_EQ(b.status(6).boot_ups, 0U);
}

TEST(BootNetwork, Boots_despite_power_cycles_at_any_moment_of_the_boot) {
    for (int moment = 1; moment < 40; ++moment) {
        Three b([](std::uint8_t, NodeSetup& n) {
            for (std::uint8_t sub = 1; sub <= 4; ++sub) {
                n.writes.push_back(object_write(0x2008, sub, std::uint8_t{9}));
            }
            n.writes[0] = object_write(0x2000, 0, std::uint32_t{9});
        });
        for (std::uint8_t sub = 1; sub <= 4; ++sub) {
            b.stations[1]->device.dictionary().find(0x2008, sub)->access = Access::read_write;
        }
        b.bus.logging = false;
        b.power();
        auto& s = *b.stations[1];
        s.delay = 3 * millisecond;  // so that moments differ
        b.start();
        b.run(moment * 4 * millisecond);
        s.plug(false, b.now);
        b.run(moment % 3 == 0 ? 700 * millisecond : 30 * millisecond);
        s.plug(true, b.now);
        ASSERT_TRUE(b.operational(20 * second))
            << "moment " << moment << ": " << b.master->sentence() << " " << b.way(6);
        EXPECT_EQ(b.value(1, 0x2000, 0), 9U);
    }
}

TEST(BootNetwork, Boots_a_node_that_stays_in_initialising) {
    Three b;
    bool told = false;
    b.stations[1]->tamper = [&](Frame& f) {
        if (f.id != 0x706) return true;
        told = told || std::ranges::any_of(b.bus.sent(0), [](const Frame& c) {
            return c.data[0] == 0x80 && c.data[1] == 6;
        });
        if (!told && f.data[0] == 0x7f) {
            f.data[0] = 0;
        }
        return true;
    };
    b.power();
    b.start();
    EXPECT_TRUE(b.operational(5 * second)) << b.master->sentence();
    EXPECT_TRUE(told);
}

TEST(BootNetwork, Boots_despite_late_responses_and_stale_aborts) {
    Three b;
    b.stations[0]->delay = 45 * millisecond;  // just in time
    // each answer comes after the question was asked again
    b.stations[1]->delay = 70 * millisecond;
    int aborts = 0;
    // an abort of an earlier transfer goes ahead of every answer
    b.stations[2]->tamper = [&](const Frame& f) {
        if (f.id == 0x587 && ++aborts > 1) {
            b.stations[2]->wire.push({0x587, {0x80, 0x06, 0x20, 0, 1, 0, 4, 5}});
        }
        return true;
    };
    b.power();
    b.start();
    EXPECT_TRUE(b.operational(20 * second)) << b.master->sentence();
    EXPECT_GT(b.status(6).sdo_retries, 0U);
    EXPECT_GT(b.master->network().node(7)->sdo().unexpected_responses(), 0U);
}

TEST(BootNetwork, Reports_a_node_that_repeats_its_toggle_bit) {
    Three b([](std::uint8_t id, NodeSetup& n) {
        if (id == 5) {
            n.guard_ms = 20;
            n.guard_factor = 4;
        }
        n.writes = {ObjectWrite{{0x2005, 0, std::vector<std::uint8_t>(30, 'x')}}};
    });
    int answers = 0;
    b.stations[0]->tamper = [&](Frame& f) {  // now and then an answer does not toggle
        if (f.id == 0x705 && ++answers % 9 == 0) {
            f.data[0] ^= 0x80;
        }
        return true;
    };
    int segments = 0;
    b.stations[1]->tamper = [&](Frame& f) {  // one answer to a segment in nine has the wrong one
        if (f.id == 0x586 && f.data[0] >> 5 <= 1 && ++segments % 9 == 0) {
            f.data[0] ^= 0x10;
        }
        return true;
    };
    b.stations[2]->tamper = [](Frame& f) {  // and all of this node's
        if (f.id == 0x587 && f.data[0] >> 5 <= 1) {
            f.data[0] ^= 0x10;
        }
        return true;
    };
    b.power();
    b.start();
    ASSERT_TRUE(
        b.until([&] { return b.status(5).operational && b.status(7).result != BootResult::none; }));
    EXPECT_GT(b.status(5).wrong_toggles, 0U);
    EXPECT_EQ(b.status(7).result, BootResult::configuration);
    EXPECT_EQ(b.master->sentence(7),
              "node 7 failed the SDO transfer of object 2005:0 while it was configured: toggle bit "
              "not alternated (05030000h); another "
              "device disturbs the transfer, or the node's SDO server is defective [result J, "
              "configuration failed]");
    ASSERT_TRUE(b.until([&] { return b.status(6).operational; }));
    EXPECT_GT(b.status(6).sdo_retries, 0U);
    b.run(20 * second);
    EXPECT_EQ(b.status(5).losses, 0U);
    EXPECT_EQ(b.master->status().state, NetworkState::booting);
    EXPECT_EQ(b.master->status().node, 7);
}

TEST(BootNetwork, Repeats_the_start_of_a_node_that_did_not_start) {
    Three b;
    int lost = 0;
    b.stations[0]->tamper = [&](const Frame& f) {
        return f.id != 0x705 || f.data[0] != 5 || ++lost > 6;
    };
    b.power();
    b.start();
    EXPECT_TRUE(b.operational());
    EXPECT_GT(std::ranges::count(b.started(), 5), 1);

    Three never([](std::uint8_t id, NodeSetup& n) {
        if (id == 6) {
            n.on_failure = Reaction::nothing;
        }
    });
    never.stations[1]->tamper = [](Frame& f) {
        if (f.id == 0x706 && f.data[0] == 5) {
            f.data[0] = 0x7f;
        }
        return true;
    };
    never.power();
    never.start();
    ASSERT_TRUE(never.until([&] { return never.status(6).step == Step::failed; }));
    EXPECT_EQ(never.master->sentence(6),
              "node 6 did not become operational after NMT start and is pre-operational; its error "
              "register "
              "is 00h");
}

TEST(BootNetwork, Reports_a_bus_that_accepts_no_frames_and_boots_once_it_does) {
    Three b;
    b.power();
    b.master->start(b.now);
    while (b.own->out().push(make_frame(0x7f0, 0))) {
    }  // the cable is out: what is queued stays
    const Time out = b.now;
    while (b.status(6).result == BootResult::none && b.now < out + 10 * second) {
        b.now += b.dt;
        b.master->poll(b.now);
    }
    EXPECT_EQ(b.status(6).cause, Cause::not_sent);
    EXPECT_EQ(
        b.master->sentence(6),
        "node 6 could not be asked for 1000:0 while it was identified: the bus accepts no frames "
        "from the master; check the "
        "master's cable, the bit rate, and that another node is connected [result B, no response]");
    b.own->out().clear();
    EXPECT_TRUE(b.operational());
}

/// An NMT command frame of another device on the bus.
struct Foreign : Three {
    FrameQueue other{16};
    Foreign() {
        bus.attach(other, [](const Frame&, Time) {});
        power();
        start();
        EXPECT_TRUE(operational());
    }
    void command(NmtCommand command, std::uint8_t id) {
        Frame f = make_frame(0, 2);
        f.data[0] = static_cast<std::uint8_t>(command);
        f.data[1] = id;
        other.push(f);
    }
};

TEST(BootNetwork, Names_the_NMT_command_of_another_device_that_preceded_a_state_change) {
    Foreign b;
    b.command(NmtCommand::stop, 6);
    ASSERT_TRUE(b.until([&] { return b.status(6).losses == 1; }, second));
    EXPECT_EQ(b.status(6).cause, Cause::left_operational);
    EXPECT_EQ(b.status(6).foreign_command, 0x02);
    EXPECT_EQ(b.master->sentence(6),
              "node 6 left the operational state after another device sent NMT stop and is "
              "stopped: remove the second NMT master");
    EXPECT_EQ(b.master->status().foreign_commands, 1U);
    ASSERT_TRUE(b.operational());
}

TEST(BootNetwork, Names_the_NMT_reset_of_another_device_that_preceded_a_reboot) {
    Foreign b;
    b.command(NmtCommand::reset_node, 0);
    ASSERT_TRUE(b.until(
        [&] { return b.status(5).losses + b.status(6).losses + b.status(7).losses == 3; }, second));
    EXPECT_EQ(b.status(7).cause, Cause::boot_up);
    EXPECT_EQ(
        b.master->sentence(7),
        "node 7 rebooted after another device sent NMT reset node: remove the second NMT master");
}

TEST(BootNetwork, Does_not_blame_a_foreign_command_that_had_no_effect) {
    Foreign b;
    b.stations[1]->powered = false;  // does not receive the command
    b.command(NmtCommand::stop, 6);
    b.run(20 * millisecond);
    b.stations[1]->powered = true;
    b.run(second);
    b.stations[1]->device.command(NmtCommand::enter_pre_operational, b.now);
    ASSERT_TRUE(b.until([&] { return b.status(6).losses == 1; }, second));
    EXPECT_EQ(b.status(6).foreign_command, 0);
    EXPECT_EQ(b.master->sentence(6),
              "node 6 left the operational state without a command from this master and is "
              "pre-operational: check the node, and the bus "
              "for another NMT master");
}

}  // namespace
}  // namespace hal::canopen::test
