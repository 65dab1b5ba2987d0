// SPDX-License-Identifier: MIT
#include "ethercat/master/topology.hpp"
#include "tests/unit/ethercat/master_world.hpp"

namespace {

using namespace master_world;

master::Setup with_clocks(unsigned count) {
    auto setup = drives(count);
    for (auto& s : setup.slaves) {
        s.dc = Dc{.assign_activate = 0x0300, .sync0_shift_ns = 250'000};
    }
    return setup;
}

TEST(EthercatClocks, Come_into_the_window_and_generate_sync0_on_one_grid) {
    World w;
    const double drifts[] = {100, -50, 30, -100};
    for (unsigned n = 0; n < 4; ++n) {
        w.add(0x100 + n, 0, false,
              {.dc_64_bit = n != 2,
               .drift_ppm = drifts[n],
               .clock_start_ns = 1'000'000'000LL * (n + 1)});
    }
    w.begin(with_clocks(4));
    ASSERT_TRUE(w.operational(8000)) << w.log.text();
    EXPECT_LT(w.cycles, 2000U);
    w.run(2500);
    EXPECT_TRUE(w.master->status().dc_active);
    EXPECT_TRUE(w.master->status().dc_synchronised) << w.master->status().dc_deviation_ns;
    for (std::size_t n = 0; n < 4; ++n) {
        const auto sync = w.line.controller(n).sync();
        ASSERT_TRUE(sync.active) << n;
        EXPECT_GT(sync.pulses, 100U) << n;
        const auto phase =
            static_cast<std::int64_t>(n == 2 ? 250'000 : sync.last_pulse_dc_ns % 1'000'000);
        EXPECT_NEAR(static_cast<double>(phase), 250'000.0, 1000.0) << n;
    }
    EXPECT_EQ(w.log.last(Event::reference_clock)->slave, 0U);
}

TEST(EthercatClocks, Phase_begins_at_zero_and_follows_the_drift_of_the_reference) {
    World w;
    for (unsigned n = 0; n < 2; ++n) {
        w.add(0x100 + n, 0, false, {.drift_ppm = 100});
    }
    w.begin(with_clocks(2));
    ASSERT_TRUE(w.until([&] { return w.master->dc_phase().fresh; }));
    const auto first = w.master->dc_phase().error_ns;
    EXPECT_NEAR(static_cast<double>(first), 0.0, 5000.0);
    w.run(1000);
    EXPECT_NEAR(static_cast<double>(w.master->dc_phase().error_ns - first), 100'000.0, 5000.0)
        << "100 ppm of a second";
}

TEST(EthercatClocks, The_reference_follows_the_thread_by_choice) {
    World w;
    for (unsigned n = 0; n < 2; ++n) {
        w.add(0x100 + n, 0, false, {.drift_ppm = 50});
    }
    auto setup = with_clocks(2);
    setup.lead = ClockLead::thread;
    w.begin(setup);
    ASSERT_TRUE(w.operational(8000)) << w.log.text();
    w.run(2000);
    EXPECT_NEAR(static_cast<double>(w.master->dc_phase().error_ns), 0.0, 5000.0);
}

TEST(EthercatClocks, Slaves_agree_where_nobody_follows) {
    World w;
    for (unsigned n = 0; n < 3; ++n) {
        w.add(0x100 + n, 0, false, {.drift_ppm = 40.0 * n});
    }
    auto setup = with_clocks(3);
    setup.lead = ClockLead::none;
    w.begin(setup);
    ASSERT_TRUE(w.operational(3000)) << w.log.text();
    w.run(2000);
    EXPECT_TRUE(w.master->status().dc_synchronised) << w.master->status().dc_deviation_ns;
}

TEST(EthercatClocks, A_clock_that_cannot_be_set_is_reported_as_that_and_set_later) {
    World w;
    for (unsigned n = 0; n < 4; ++n) {
        w.add(0x100 + n, 0, false, {.drift_ppm = 10.0 * n});
    }
    w.line.close_ring(3, 1);
    w.begin(with_clocks(4), true);
    ASSERT_TRUE(w.operational(8000)) << w.log.text();
    w.line.set_power(2, false, w.now_ns);
    w.run(200);
    w.line.set_cable(3, 0, false);  // while the ring is broken no delays are measured
    w.line.set_power(2, true, w.now_ns);
    ASSERT_TRUE(w.until([&] { return w.log.count(Event::dc_not_set) != 0; }, 8000)) << w.log.text();
    EXPECT_EQ(w.log.last(Event::dc_not_set)->slave, 2U);
    EXPECT_EQ(w.log.count(Event::dc_timeout), 0U);
    w.line.set_cable(3, 0, true);
    EXPECT_TRUE(w.operational(20000)) << w.log.text();
}

TEST(EthercatClocks, Sync_signals_begin_in_the_future_at_any_cycle) {
    for (const std::int64_t cycle_ns : {100'000LL, 50'000'000LL, 1'000'000'000LL}) {
        World w;
        w.cycle_ns = cycle_ns;
        for (unsigned n = 0; n < 2; ++n) {
            w.add(0x100 + n);
        }
        auto setup = with_clocks(2);
        setup.cycle_ns = cycle_ns;
        w.begin(setup);
        ASSERT_TRUE(w.operational(8000)) << cycle_ns << ": " << w.log.text();
        w.run(20);
        for (std::size_t n = 0; n < 2; ++n) {
            EXPECT_GT(w.line.controller(n).sync().pulses, 5U) << cycle_ns << " " << n;
        }
    }
}

TEST(EthercatClocks, Sync_signals_start_when_the_start_time_has_passed_before_the_activation) {
    World w;
    w.add(0x100);
    w.begin(with_clocks(1));
    const auto is_start_written = [&] {
        return get<std::uint64_t>(w.line.controller(0).memory(registers::dc_start_time)) != 0;
    };
    ASSERT_TRUE(w.until(is_start_written));
    w.now_ns += 100'000'000;  // the host was suspended
    ASSERT_TRUE(w.operational(500)) << w.log.text();
    w.run(20);
    EXPECT_GT(w.line.controller(0).sync().pulses, 5U);
    EXPECT_EQ(w.log.count(Event::start_up_failed), 0U) << w.log.text();
}

TEST(EthercatClocks, A_clock_that_leaves_the_window_in_OP_is_reported_once) {
    World w;
    for (unsigned n = 0; n < 2; ++n) {
        w.add(0x100 + n);
    }
    w.begin(with_clocks(2));
    ASSERT_TRUE(w.operational(3000)) << w.log.text();
    w.run(3000);
    EXPECT_EQ(w.log.count(Event::dc_lost), 0U) << w.log.text();
    w.line.controller(1).set_drift(50'000, w.now_ns);
    w.run(5000);
    ASSERT_EQ(w.log.count(Event::dc_lost), 1U) << w.log.text();
    EXPECT_EQ(w.log.last(Event::dc_lost)->slave, 1U);
    EXPECT_GT(w.log.last(Event::dc_lost)->first, 10'000);
    EXPECT_FALSE(w.master->status().dc_synchronised);
    w.line.set_power(1, false, w.now_ns);
    w.run(200);
    w.line.controller(1).set_drift(0, w.now_ns);
    w.line.set_power(1, true, w.now_ns);
    ASSERT_TRUE(w.operational(20000)) << w.log.text();
    w.run(2000);
    EXPECT_TRUE(w.master->status().dc_synchronised);
    w.line.controller(1).set_drift(50'000, w.now_ns);
    w.run(5000);
    EXPECT_EQ(w.log.count(Event::dc_lost), 2U) << "again";
}

TEST(EthercatClocks, A_clock_that_is_back_in_the_window_is_reported_and_a_short_excursion_is_not) {
    World w;
    for (unsigned n = 0; n < 2; ++n) {
        w.add(0x100 + n);
    }
    w.begin(with_clocks(2));
    ASSERT_TRUE(w.operational(3000)) << w.log.text();
    w.run(3000);
    w.line.controller(1).jump_clock(60'000, w.now_ns);  // its filter takes about 250 us/s back
    w.run(3000);
    EXPECT_EQ(w.log.count(Event::dc_lost) + w.log.count(Event::dc_recovered), 0U) << w.log.text();
    w.line.controller(1).jump_clock(400'000, w.now_ns);
    w.run(1000);
    ASSERT_EQ(w.log.count(Event::dc_lost), 1U) << w.log.text();
    EXPECT_EQ(w.log.count(Event::dc_recovered), 0U);
    EXPECT_TRUE(w.master->status().operational) << "it stays in OP";
    w.run(3000);
    ASSERT_EQ(w.log.count(Event::dc_recovered), 1U) << w.log.text();
    EXPECT_EQ(w.log.last(Event::dc_recovered)->slave, 1U);
    EXPECT_LE(w.log.last(Event::dc_recovered)->first, 1000);
    EXPECT_GE(w.log.last(Event::dc_recovered)->second, 900);
    EXPECT_EQ(w.log.count(Event::dc_lost), 1U);
}

TEST(EthercatClocks, A_reference_clock_that_jumps_is_named_and_not_the_slaves_behind_it) {
    for (const std::int64_t jump_ns : {400'000LL, -400'000LL}) {
        World w;
        for (unsigned n = 0; n < 3; ++n) {
            w.add(0x100 + n);
        }
        w.begin(with_clocks(3));
        ASSERT_TRUE(w.operational(3000)) << w.log.text();
        w.run(3000);
        w.line.controller(0).jump_clock(jump_ns, w.now_ns);
        w.run(1000);
        ASSERT_EQ(w.log.count(Event::dc_jumped), 1U) << w.log.text();
        EXPECT_EQ(w.log.last(Event::dc_jumped)->slave, 0U);
        EXPECT_NEAR(static_cast<double>(w.log.last(Event::dc_jumped)->first),
                    static_cast<double>(jump_ns), 10'000.0);
        EXPECT_EQ(w.log.count(Event::dc_lost), 0U) << w.log.text();
        EXPECT_EQ(w.log.count(Event::dc_jump_ended), 0U);
        w.run(4000);
        ASSERT_EQ(w.log.count(Event::dc_jump_ended), 1U) << w.log.text();
        EXPECT_EQ(w.log.last(Event::dc_jump_ended)->slave, 0U);
        EXPECT_EQ(w.log.count(Event::dc_recovered), 0U);
        w.line.controller(2).jump_clock(jump_ns, w.now_ns);
        w.run(1000);
        ASSERT_EQ(w.log.count(Event::dc_lost), 1U) << w.log.text();
        EXPECT_EQ(w.log.last(Event::dc_lost)->slave, 2U) << "its own clock";
        EXPECT_EQ(w.log.count(Event::dc_jumped), 1U);
    }
}

TEST(EthercatClocks, A_small_jump_of_the_reference_clock_is_not_taken_for_one_of_another_clock) {
    for (const std::int64_t jump_ns : {60'000LL, -60'000LL, 80'000LL}) {
        World w;
        for (unsigned n = 0; n < 3; ++n) {
            w.add(0x100 + n);
        }
        auto setup = with_clocks(3);
        setup.dc_loss_ns = 1'000'000;
        w.begin(setup);
        ASSERT_TRUE(w.operational(3000)) << w.log.text();
        w.run(3000);
        w.line.controller(0).jump_clock(jump_ns, w.now_ns);
        w.run(1000);
        ASSERT_EQ(w.log.count(Event::dc_jumped), 1U) << jump_ns << w.log.text();
        EXPECT_EQ(w.log.last(Event::dc_jumped)->slave, 0U);
        EXPECT_EQ(w.log.count(Event::dc_lost), 0U) << jump_ns << w.log.text();
        w.run(4000);
        w.line.controller(2).jump_clock(jump_ns, w.now_ns);
        w.run(1000);
        ASSERT_EQ(w.log.count(Event::dc_lost), 1U) << jump_ns << w.log.text();
        EXPECT_EQ(w.log.last(Event::dc_lost)->slave, 2U) << "its own clock";
        EXPECT_EQ(w.log.count(Event::dc_jumped), 1U);
    }
}

TEST(EthercatClocks, A_reference_clock_that_the_setup_does_not_name_is_named_by_its_position) {
    World w;
    for (unsigned n = 0; n < 3; ++n) {
        w.add(0x100 + n);
    }
    auto setup = with_clocks(3);
    setup.slaves.erase(setup.slaves.begin());
    w.begin(setup);
    ASSERT_TRUE(w.operational(3000)) << w.log.text();
    w.run(3000);
    w.line.controller(0).jump_clock(400'000, w.now_ns);
    w.run(1000);
    ASSERT_EQ(w.log.count(Event::dc_jumped), 1U) << w.log.text();
    EXPECT_EQ(w.log.last(Event::dc_jumped)->slave, Events::of_position + 0U);
    EXPECT_EQ(w.log.count(Event::dc_lost), 0U) << w.log.text();
    w.run(4000);
    EXPECT_EQ(w.log.count(Event::dc_jump_ended), 1U) << w.log.text();
}

TEST(EthercatClocks, A_slave_out_of_step_waits_in_SAFE_OP_where_the_setup_says_so) {
    World w;
    for (unsigned n = 0; n < 3; ++n) {
        w.add(0x100 + n);
    }
    auto setup = with_clocks(3);
    setup.dc_loss = DcLoss::safeop;
    setup.dc_loss_ns = 200'000'000;
    w.begin(setup);
    ASSERT_TRUE(w.operational(3000)) << w.log.text();
    w.run(3000);
    const auto state = [&](unsigned n) { return w.line.controller(n).al_status() & 0x1f; };
    w.line.controller(1).jump_clock(400'000, w.now_ns);
    ASSERT_TRUE(w.until([&] { return w.log.count(Event::dc_lost) == 1; }, 600)) << w.log.text();
    ASSERT_TRUE(w.until([&] { return state(1) == 4; }, 50));
    w.run(700);
    EXPECT_EQ(state(1), 4) << "its clock is still beyond the window";
    EXPECT_FALSE(w.master->slave_status(1).operational);
    EXPECT_EQ(w.log.count(Event::dc_lost), 1U);
    for (const unsigned other : {0U, 2U}) {
        EXPECT_TRUE(w.master->slave_status(other).operational);
        EXPECT_EQ(state(other), 8);
    }
    ASSERT_TRUE(w.operational(3000)) << w.log.text();
    EXPECT_EQ(state(1), 8);
    const auto apart = w.line.controller(1).clock().system_time(w.now_ns) -
                       w.line.controller(0).clock().system_time(w.now_ns);
    EXPECT_LT(std::abs(apart), 2000);
    w.run(2000);
    EXPECT_EQ(w.log.count(Event::dc_lost), 1U);
    w.line.controller(1).jump_clock(400'000, w.now_ns);
    w.run(1000);
    EXPECT_EQ(w.log.count(Event::dc_lost), 2U) << "again";
}

TEST(EthercatClocks, A_slave_that_starts_with_its_clock_outside_the_window_is_reported) {
    World w;
    for (unsigned n = 0; n < 2; ++n) {
        w.add(0x100 + n);
    }
    auto setup = with_clocks(2);
    setup.sync_window_ns = 10;
    w.begin(setup);
    std::int64_t jump_ns = 3'000;
    for (unsigned n = 0; n < 20'000 && !w.master->status().operational; ++n) {
        w.cycle();
        if (n % 5 == 0) {
            w.line.controller(1).jump_clock(jump_ns, w.now_ns);
            jump_ns = -jump_ns;
        }
    }
    ASSERT_TRUE(w.master->status().operational) << w.log.text();
    ASSERT_EQ(w.log.count(Event::dc_tolerated), 1U) << w.log.text();
    EXPECT_EQ(w.log.last(Event::dc_tolerated)->slave, 1U);
    EXPECT_GT(w.log.last(Event::dc_tolerated)->first, 10);
    EXPECT_EQ(w.log.last(Event::dc_tolerated)->second, 10);
}

TEST(EthercatClocks, A_slave_that_stays_out_of_step_is_started_anew) {
    World w;
    for (unsigned n = 0; n < 2; ++n) {
        w.add(0x100 + n);
    }
    auto setup = with_clocks(2);
    setup.dc_loss = DcLoss::safeop;
    w.begin(setup);
    ASSERT_TRUE(w.operational(3000)) << w.log.text();
    w.line.controller(1).set_drift(50'000, w.now_ns);
    ASSERT_TRUE(w.until([&] { return w.log.count(Event::dc_timeout) != 0; }, 30000))
        << w.log.text();
    w.line.controller(1).set_drift(0, w.now_ns);
    ASSERT_TRUE(w.operational(30000)) << w.log.text();
}

TEST(EthercatClocks, A_ring_of_slaves_that_were_switched_on_at_other_times_is_in_step) {
    World w;
    for (unsigned n = 0; n < 4; ++n) {
        w.add(0x100 + n, 0, false, {.clock_start_ns = 777'000'000LL * n});
    }
    w.line.close_ring(3, 1);
    w.begin(with_clocks(4), true);
    ASSERT_TRUE(w.operational(8000)) << w.log.text();
    w.line.set_power(2, false, w.now_ns);
    w.run(3000);
    w.line.set_power(2, true, w.now_ns);
    ASSERT_TRUE(w.operational(8000)) << w.log.text();
    w.run(1000);
    for (std::size_t n = 1; n < 4; ++n) {
        const auto apart = (w.line.controller(n).sync().last_pulse_ns -
                            w.line.controller(0).sync().last_pulse_ns) %
                           1'000'000;
        EXPECT_LT(std::min(std::abs(apart), 1'000'000 - std::abs(apart)), 2000) << n;
    }
}

TEST(EthercatClocks, A_slave_without_clock_that_needs_one_is_reported) {
    World w;
    w.add(0x100);
    w.add(0x101, 0, false, {.dc = false});
    w.begin(with_clocks(2));
    EXPECT_TRUE(w.until([&] { return w.log.count(Event::dc_unsupported) != 0; }));
    EXPECT_EQ(w.log.last(Event::dc_unsupported)->slave, 1U);
}

TEST(EthercatTopology, Finds_the_tree_of_a_fork) {
    // 0 has 1 at port 3 (with 2 behind it) and 3 at port 1.
    std::array<BusSlave, 4> slaves;
    std::array<BusSlave*, 4> line{};
    const auto use = [](std::initializer_list<unsigned> ports) {
        unsigned status = 0x5500;  // loops closed
        for (const unsigned p : ports) {
            status = (status & ~(3U << (8 + 2 * p))) | 2U << (8 + 2 * p);
        }
        return static_cast<std::uint16_t>(status);
    };
    slaves[0].dl_status = use({0, 1, 3});
    slaves[1].dl_status = use({0, 1});
    slaves[2].dl_status = use({0});
    slaves[3].dl_status = use({0});
    for (unsigned n = 0; n < 4; ++n) {
        slaves[n].number = static_cast<std::uint16_t>(n);
        slaves[n].features = 0x0c;

        line[n] = &slaves[n];
    }
    ASSERT_TRUE(find_tree(line));
    EXPECT_EQ(slaves[1].parent, 0);
    EXPECT_EQ(slaves[1].parent_port, 3);
    EXPECT_EQ(slaves[2].parent, 1);
    EXPECT_EQ(slaves[3].parent, 0);
    EXPECT_EQ(slaves[3].parent_port, 1);
    // 100 ns per hop there, and per hop back.
    slaves[0].receive_time = {1000, 1600, 0, 1400};
    slaves[1].receive_time = {5100, 5300, 0, 0};
    slaves[2].receive_time = {7000, 0, 0, 0};
    slaves[3].receive_time = {9000, 0, 0, 0};
    find_delays(line, 0);
    EXPECT_EQ(slaves[1].delay_ns, 100U);
    EXPECT_EQ(slaves[2].delay_ns, 200U);
    EXPECT_EQ(slaves[3].delay_ns, 500U);
}

}  // namespace
