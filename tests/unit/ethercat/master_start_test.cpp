// SPDX-License-Identifier: MIT
#include "tests/unit/ethercat/master_world.hpp"

namespace {

using namespace master_world;

TEST(EthercatMaster, Brings_slaves_to_op_and_exchanges_process_data) {
    World w;
    for (unsigned n = 0; n < 3; ++n) {
        w.add(0x100 + n);
    }
    w.begin(drives(3));
    ASSERT_TRUE(w.operational()) << w.log.text();
    EXPECT_LT(w.cycles, 250U);
    EXPECT_EQ(w.master->status().responding, 3);
    EXPECT_EQ(w.master->status().state, State::op);
    for (std::size_t n = 0; n < 3; ++n) {
        w.master->data(n, 0)[0] = static_cast<std::uint8_t>(10 * n + 5);
    }
    w.run(4);
    for (std::size_t n = 0; n < 3; ++n) {
        EXPECT_EQ(w.master->data(n, 1)[0], 10 * n + 6);
    }
    EXPECT_EQ(w.master->domain(0).state, WkcState::complete);
    EXPECT_EQ(w.master->domain(0).expected, 9)
        << "two for outputs and one for inputs of each slave";
    EXPECT_EQ(w.master->status().lost, 0U);
    EXPECT_EQ(w.master->status().foreign, 0U);
    EXPECT_EQ(w.log.count(Event::slave_operational), 3U);
}

TEST(EthercatMaster, Reports_an_empty_bus_once_and_finds_slaves_that_come_later) {
    World w;
    w.add(0x100);
    w.begin(drives(1));
    w.line.set_power(0, false, 0);
    w.run(500);
    EXPECT_EQ(w.log.count(Event::no_slaves), 1U);
    w.line.set_power(0, true, w.now_ns);
    EXPECT_TRUE(w.operational()) << w.log.text();
}

TEST(EthercatMaster, Refuses_a_slave_of_another_product) {
    World w;
    w.add(0x100);
    w.add(0x999);
    w.begin(drives(2));
    w.run(600);
    EXPECT_FALSE(w.master->status().operational);
    const auto* e = w.log.last(Event::wrong_product);
    ASSERT_NE(e, nullptr);
    EXPECT_EQ(e->slave, 1U);
    EXPECT_EQ(e->first, 0x999);
    EXPECT_EQ(e->second, 0x101);
    EXPECT_EQ(w.master->slave_status(0).state, State::op) << "the others run";
    EXPECT_EQ(w.master->slave_status(1).state, State::init);
}

TEST(EthercatMaster, Reports_slaves_that_are_missing_or_not_named) {
    World w;
    w.add(0x100);
    w.begin(drives(2));
    w.run(400);
    ASSERT_EQ(w.log.count(Event::slave_missing), 1U);
    EXPECT_EQ(w.log.last(Event::slave_missing)->slave, 1U);
    EXPECT_FALSE(w.master->status().operational);

    World more;
    more.add(0x100);
    more.add(0x200);
    more.begin(drives(1));
    EXPECT_TRUE(more.operational());
    ASSERT_EQ(more.log.count(Event::unknown_slave), 1U);
    EXPECT_EQ(more.log.last(Event::unknown_slave)->slave, Events::of_position + 1);
}

TEST(EthercatMaster, Finds_a_slave_by_its_alias) {
    World w;
    w.add(0x100);
    w.add(0x101, 77);
    w.add(0x102);
    master::Setup setup = drives(3);
    setup.slaves[1].position = 2;
    setup.slaves[1].identity.alias = 77;
    w.begin(setup);
    ASSERT_TRUE(w.operational()) << w.log.text();
    EXPECT_EQ(w.master->slave(1)->position, 1);
}

TEST(EthercatMaster, Finds_a_slave_by_its_device_identification) {
    World w;
    w.add(0x100);
    w.add(0x102);
    w.add(0x101).device_id = 42;
    master::Setup setup = drives(3);
    setup.slaves[1].identity.device_id = 42;
    setup.slaves[2].position = 1;
    w.begin(setup);
    ASSERT_TRUE(w.operational()) << w.log.text();
    EXPECT_EQ(w.master->slave(1)->position, 2);
}

TEST(EthercatMaster, Reports_a_refused_state_with_its_code_and_tries_again) {
    World w;
    Firmware& f = w.add(0x100);
    f.refuse = 4;
    f.code = 0x1d;
    w.begin(drives(1));
    ASSERT_TRUE(w.until([&] { return w.log.count(Event::start_up_failed) != 0; }));
    const auto* e = w.log.last(Event::state_refused);
    ASSERT_NE(e, nullptr);
    EXPECT_EQ(e->first, 4);
    EXPECT_EQ(e->second, 0x1d);
    f.refuse = 0;
    EXPECT_TRUE(w.operational()) << w.log.text();
}

TEST(EthercatMaster, Waits_for_no_state_without_a_timeout) {
    for (const std::uint16_t state : std::initializer_list<std::uint16_t>{2, 4, 8}) {
        World w;
        Firmware& f = w.add(0x100);
        f.ignore = state;
        auto setup = drives(1);
        setup.slaves[0].timeouts.to_preop = 300;
        setup.slaves[0].timeouts.to_safeop_op = 500;
        w.begin(setup);
        ASSERT_TRUE(w.until([&] { return w.log.count(Event::state_timeout) != 0; }, 800))
            << state << ": " << w.log.text();
        EXPECT_EQ(w.log.last(Event::state_timeout)->first, state);
        w.run(5000);
        EXPECT_FALSE(w.master->status().operational);
        EXPECT_GE(w.log.count(Event::state_timeout), 2U) << "it is tried again";
        f.ignore = 0;
        EXPECT_TRUE(w.operational(15000)) << state << ": " << w.log.text();
    }
}

TEST(EthercatMaster, A_shut_down_takes_all_slaves_out_of_OP_at_once_and_restart_brings_them_back) {
    for (const unsigned count : {3U, 150U}) {  // more than one frame holds
        World w;
        for (unsigned n = 0; n < count; ++n) {
            w.add(0x100 + n);
        }
        w.begin(drives(count));
        ASSERT_TRUE(w.operational()) << w.log.text();
        const auto all_are = [&](State state) {
            for (unsigned n = 0; n < count; ++n) {
                if ((w.line.controller(n).al_status() & 0x1f) != static_cast<unsigned>(state)) {
                    return false;
                }
            }
            return true;
        };
        ASSERT_TRUE(all_are(State::op));
        w.master->shut_down();
        w.line.advance(w.now_ns + 1);
        EXPECT_TRUE(all_are(State::safeop)) << "before another cycle";

        w.now_ns += 1'000'000'000;
        w.master->receive(w.now_ns);
        w.master->restart();
        EXPECT_FALSE(w.master->status().operational);
        for (unsigned n = 0; n < count; ++n) {
            EXPECT_FALSE(w.master->slave_status(n).operational);
        }
        ASSERT_TRUE(w.operational()) << w.log.text();
        EXPECT_TRUE(all_are(State::op));
        EXPECT_EQ(w.log.count(Event::fell_back), 0U);
        EXPECT_EQ(w.master->status().foreign, 0U) << "the frames were its own";
    }
}

TEST(EthercatMaster, A_slave_in_the_lower_state_of_its_setup_is_not_operational) {
    World w;
    w.add(0x100);
    w.add(0x101);
    auto setup = drives(2);
    setup.slaves[1].target = State::safeop;
    w.begin(setup);
    ASSERT_TRUE(w.operational()) << "the bus does not wait for it: " << w.log.text();
    EXPECT_TRUE(w.master->slave_status(0).operational);
    EXPECT_FALSE(w.master->slave_status(1).operational);
    EXPECT_EQ(w.log.count(Event::slave_operational), 1U);
    ASSERT_EQ(w.log.count(Event::slave_settled), 1U);
    EXPECT_EQ(w.log.last(Event::slave_settled)->first, static_cast<std::int64_t>(State::safeop));
    w.run(500);
    EXPECT_EQ(w.log.count(Event::slave_settled), 1U) << "it is not started again and again";
}

TEST(EthercatMaster, A_slave_that_fails_leaves_the_working_counter_of_the_others_complete) {
    World w;
    w.add(0x100);
    Firmware& f = w.add(0x101);
    f.refuse = 4;
    f.code = 0x1d;
    w.begin(drives(2));
    ASSERT_TRUE(w.until([&] {
        return w.log.count(Event::start_up_failed) != 0 && w.master->slave_status(0).operational;
    }));
    w.run(5);
    w.log.all.clear();
    unsigned incomplete = 0;
    for (unsigned n = 0; n < 700; ++n) {
        w.cycle();
        incomplete += w.master->status().wkc_state != WkcState::complete;
    }
    EXPECT_EQ(incomplete, 0U);
    EXPECT_EQ(w.log.count(Event::wkc_incomplete), 0U) << w.log.text();
}

TEST(EthercatMaster, Slaves_of_the_same_alias_are_both_not_started) {
    World w;
    w.add(0x100, 5);
    w.add(0x100, 5);
    auto setup = drives(1);
    setup.slaves[0].identity.alias = 5;
    w.begin(setup);
    w.run(2000);
    ASSERT_EQ(w.log.count(Event::duplicate_alias), 1U) << w.log.text();
    EXPECT_EQ(w.log.last(Event::duplicate_alias)->second, 1);
    EXPECT_EQ(w.log.count(Event::unknown_slave), 0U);
    for (std::size_t n = 0; n < 2; ++n) {
        EXPECT_EQ(w.line.controller(n).al_status() & 0x0f, 1);
    }
}

TEST(EthercatMaster, Too_many_slaves_are_reported_once_and_again_when_they_are_others) {
    World w;
    for (unsigned n = 0; n < 5; ++n) {
        w.add(0x100 + n);
    }
    auto setup = drives(1);
    setup.max_slaves = 3;
    w.begin(setup);
    w.run(2000);
    ASSERT_EQ(w.log.count(Event::too_many_slaves), 1U);
    EXPECT_EQ(w.log.last(Event::too_many_slaves)->first, 5);
    EXPECT_EQ(w.log.last(Event::too_many_slaves)->second, 3);
    w.line.set_cable(4, 0, false);
    w.run(1000);
    EXPECT_EQ(w.log.count(Event::too_many_slaves), 2U);
    w.line.set_cable(3, 0, false);
    EXPECT_TRUE(w.operational()) << w.log.text();
}

TEST(EthercatMaster, A_port_without_link_is_reported_and_no_missing_slaves) {
    World w;
    w.add(0x100);
    w.primary.up = false;
    w.begin(drives(1));
    w.run(500);
    EXPECT_EQ(w.log.count(Event::link_lost), 1U);
    EXPECT_EQ(w.log.count(Event::no_slaves), 0U);
    EXPECT_FALSE(w.master->status().link);
    w.primary.up = true;
    EXPECT_TRUE(w.operational()) << w.log.text();
    EXPECT_EQ(w.log.count(Event::link_restored), 1U);
}

TEST(EthercatMaster, A_settled_bus_needs_one_frame_in_each_cycle) {
    World w;
    for (unsigned n = 0; n < 3; ++n) {
        w.add(0x100 + n);
    }
    w.begin(drives(3));
    ASSERT_TRUE(w.operational()) << w.log.text();
    w.run(100);
    const std::uint64_t before = w.primary.sent;
    w.run(3000);
    EXPECT_EQ(w.primary.sent - before, 3000U) << "the supervision's datagrams share that frame";
    EXPECT_EQ(w.master->cycles_incomplete(), 0U);
}

TEST(EthercatMaster, A_lost_frame_loses_nothing_that_it_carried_for_the_supervision) {
    World w;
    w.add(0x100);
    w.begin(drives(1));
    ASSERT_TRUE(w.operational()) << w.log.text();
    w.primary.lose_every = 3;
    w.run(3000);
    w.primary.lose_every = 0;
    w.run(100);
    EXPECT_TRUE(w.master->status().operational) << w.log.text();
    EXPECT_EQ(w.log.count(Event::slave_lost), 0U) << w.log.text();
    EXPECT_EQ(w.master->status().late, 0U);
    EXPECT_EQ(w.master->status().foreign, 0U);
    EXPECT_NEAR(static_cast<double>(w.master->status().lost), 1000.0, 20.0);
}

TEST(EthercatMaster, Two_masters_that_begin_together_notice_each_other) {
    World w;
    w.add(0x100);
    EndPort second(w.line, esc::End::primary);
    second.mine[5] = 2;
    w.primary.other_master = &second;
    second.other_master = &w.primary;
    Log log;
    hal::ethercat::master::Master other(drives(1), second.mine, log, w.objects);
    w.begin(drives(1));
    other.attach(second);
    for (unsigned n = 0; n < 13000; ++n) {
        w.cycle();
        other.receive(w.now_ns);
        other.transmit(w.now_ns);
    }
    EXPECT_EQ(w.log.count(Event::other_master), 1U) << w.log.text();
    EXPECT_EQ(log.count(Event::other_master), 1U) << log.text();
    EXPECT_EQ(w.log.count(Event::no_slaves), 0U) << "the other master's frames are not answers";
}

TEST(EthercatMaster,
     Own_frames_that_return_after_hundreds_of_cycles_are_not_those_of_another_master) {
    World w;
    w.add(0x100);
    w.begin(drives(1));
    ASSERT_TRUE(w.operational()) << w.log.text();
    for (const unsigned cycles : {5U, 90U, 300U, 1000U}) {
        const std::uint64_t late = w.master->status().late;
        w.primary.stalled = true;
        for (unsigned n = 0; n < cycles; ++n) {
            w.cycle();
        }
        w.primary.stalled = false;
        for (unsigned n = 0; n < 3000; ++n) {
            w.cycle();
        }
        EXPECT_GE(w.master->status().late, late + 1) << cycles;
    }
    EXPECT_EQ(w.log.count(Event::other_master), 0U) << w.log.text();
    EXPECT_EQ(w.master->status().foreign, 0U);
}

TEST(EthercatMaster, Writes_only_mappings_that_differ_and_reads_them_back) {
    for (const bool assignment_first : {true, false}) {
        World w;
        w.add(0x100, 0, true);
        master::Setup setup = drives(1);
        for (auto& sm : setup.slaves[0].sync_managers) {
            sm.write_assignment = true;
            sm.assignment_first = assignment_first;
            for (auto& pdo : sm.pdos) {
                pdo.write_mapping = true;
            }
        }
        auto& v = w.objects.values;
        v[0x1c1200] = {1};
        v[0x1c1201] = {0x00, 0x16};                      // outputs as wanted
        v[0x160000] = {2};
        v[0x160001] = {8, 1, 0, 0x70};
        v[0x160002] = {8, 1, 1, 0x70};
        v[0x1c1300] = {1};
        v[0x1c1301] = {0x01, 0x1a};                      // inputs are not
        v[0x1a0000] = {1};
        v[0x1a0001] = {8, 1, 0, 0x60};
        w.begin(setup);
        ASSERT_TRUE(w.operational()) << w.log.text();
        const std::vector<std::uint32_t> first{0x1c1300, 0x1a0000, 0x1a0001, 0x1a0002,
                                               0x1a0000, 0x1c1301, 0x1c1300};
        const std::vector<std::uint32_t> last{0x1a0000, 0x1a0001, 0x1a0002, 0x1a0000,
                                              0x1c1300, 0x1c1301, 0x1c1300};
        EXPECT_EQ(w.objects.written, assignment_first ? first : last);
        EXPECT_EQ(v[0x1a0002], (std::vector<std::uint8_t>{8, 1, 1, 0x60}));
    }
}

TEST(EthercatMaster, Reports_the_object_of_a_start_up_write_that_is_refused) {
    World w;
    w.add(0x100, 0, true);
    master::Setup setup = drives(1);
    StartupWrite write;
    write.index = 0x6060;
    write.data = {8};
    setup.slaves[0].startup.push_back(write);
    w.objects.refuse = 0x606000;
    w.begin(setup);
    ASSERT_TRUE(w.until([&] { return w.log.count(Event::startup_write_failed) != 0; }));
    EXPECT_EQ(w.log.last(Event::startup_write_failed)->first, 0x606000);
    EXPECT_EQ(w.log.last(Event::startup_write_failed)->second, 0x06090030);
}

TEST(EthercatMaster,
     Splits_process_data_over_frames_and_uses_lrd_and_lwr_where_lrw_is_not_supported) {
    World w;
    for (unsigned n = 0; n < 40; ++n) {
        w.add(0x100 + n, 0, false, {.lrw = n != 3}).inputs = 40;
    }
    master::Setup setup = drives(40, 40);
    w.begin(setup);
    ASSERT_TRUE(w.operational()) << w.log.text();
    for (std::size_t n = 0; n < 40; ++n) {
        w.master->data(n, 0)[39] = static_cast<std::uint8_t>(n);
    }
    w.run(4);
    for (std::size_t n = 0; n < 40; ++n) {
        EXPECT_EQ(w.master->data(n, 1)[39], n + 1) << n;
    }
    EXPECT_EQ(w.master->domain(0).state, WkcState::complete);
}

TEST(EthercatMaster, Exchanges_a_slow_domain_in_every_nth_cycle_once_operational) {
    World w;
    for (unsigned n = 0; n < 2; ++n) {
        w.add(0x100 + n);
    }
    master::Setup setup = drives(2);
    setup.domains = {{"fast", 1}, {"slow", 4}};
    setup.slaves[1].domain = 1;
    w.begin(setup);
    ASSERT_TRUE(w.operational());
    const auto fast = w.master->domain(0).exchanges;
    const auto slow = w.master->domain(1).exchanges;
    w.run(40);
    EXPECT_EQ(w.master->domain(0).exchanges - fast, 40U);
    EXPECT_NEAR(static_cast<double>(w.master->domain(1).exchanges - slow), 10.0, 1.0);
}

TEST(EthercatStart, A_slave_without_mailbox_keeps_its_process_data_whatever_the_setup_would_map) {
    for (const std::uint16_t bytes : std::initializer_list<std::uint16_t>{2, 3}) {
        World w;
        w.add(0x100);
        auto setup = drives(1, bytes);
        for (auto& sm : setup.slaves[0].sync_managers) {
            sm.write_assignment = sm.pdos[0].write_mapping = true;
        }
        w.begin(setup);
        EXPECT_EQ(w.operational(500), bytes == 2) << w.log.text();
        if (bytes == 2) continue;
        ASSERT_NE(w.log.last(Event::fixed_size), nullptr) << w.log.text();
        EXPECT_EQ(w.log.last(Event::fixed_size)->first, 2 << 16 | 3);
        EXPECT_EQ(w.log.last(Event::fixed_size)->second, 2);
    }
}

}  // namespace
