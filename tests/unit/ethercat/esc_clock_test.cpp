// SPDX-License-Identifier: MIT
#include "ethercat/esc/responder.hpp"
#include "tests/unit/ethercat/esc_world.hpp"

namespace {

using namespace esc_world;

TEST(EscClock, Time_of_is_the_inverse_of_at) {
    esc::Clock clock;
    clock.set_drift(137.5, 0);
    clock.reset(1'000, 77);
    for (std::int64_t now = 1'000; now < 4'000'000'000; now += 123'456'789) {
        const std::int64_t local = clock.at(now);
        EXPECT_EQ(clock.at(clock.time_of(local)), local);
        clock.shift(0.25, now);
    }
    EXPECT_EQ(clock.at(4'000'000'000) - clock.at(3'000'000'000), 1'000'137'500);
}

/// Two slaves with clocks; the second drifts.
struct Clocks : testing::Test {
    World w;
    std::array<Firmware, 2> firmware;
    void start(double drift_ppm, bool wide = true) {
        w.line.add(
            {.controller = {.clock_start_ns = 5'000}, .sii = image(), .application = &firmware[0]});
        w.line.add(
            {.controller = {.dc_64_bit = wide, .drift_ppm = drift_ppm, .clock_start_ns = 900'000},
             .sii = image(),
             .application = &firmware[1]});
        w.line.power_on(0);
        for (unsigned i = 0; i < 2; ++i) {
            w.write<std::uint16_t>(i, registers::station_address,
                                   static_cast<std::uint16_t>(0x1001 + i));
        }
        w.send(Command::bwr, at_station(0, registers::dc_receive_time), {0});
        const auto t0 = w.read<std::uint64_t>(0, registers::dc_receive_time_unit);

        const auto t1 = w.read<std::uint64_t>(1, registers::dc_receive_time_unit);
        constexpr std::int64_t epoch = 700'000'000'000'000'000;
        w.write<std::int64_t>(0, registers::dc_system_time_offset,
                              epoch - static_cast<std::int64_t>(t0));
        w.write<std::int64_t>(1, registers::dc_system_time_offset,
                              epoch + 690 - static_cast<std::int64_t>(t1));
        w.write<std::uint32_t>(1, registers::dc_system_time_delay, 690);
        w.send(Command::bwr, at_station(0, registers::dc_speed_counter_start), {0x00, 0x10});
    }
    void cycle(int times, std::int64_t ns = 1'000'000) {
        w.gap_ns = ns;
        for (int i = 0; i < times; ++i) {
            EXPECT_EQ(w.send(Command::frmw, at_station(0x1001, registers::dc_system_time),
                             std::vector<std::uint8_t>(8)),
                      2);
        }
    }
    std::int64_t difference() {
        return w.line.controller(1).clock().system_time(w.now_ns) -
               w.line.controller(0).clock().system_time(w.now_ns);
    }
};

TEST_F(Clocks, Drifting_clock_is_held_by_frmw) {
    start(100);
    w.gap_ns = 1'000'000;
    cycle(1500);
    EXPECT_NEAR(static_cast<double>(difference()), 0, 5);
    EXPECT_LE(w.read<std::uint32_t>(1, registers::dc_system_time_difference) & 0x7fffffff, 5U);
    w.line.controller(1).set_drift(-60, w.now_ns);
    cycle(1500);
    EXPECT_NEAR(static_cast<double>(difference()), 0, 5);
    w.line.controller(1).jump_clock(20'000, w.now_ns);
    EXPECT_NEAR(static_cast<double>(difference()), 20'000, 5);
    cycle(50);
    EXPECT_GT(w.read<std::uint32_t>(1, registers::dc_system_time_difference) & 0x7fffffff, 500U);
    cycle(2000);
    EXPECT_NEAR(static_cast<double>(difference()), 0, 5);
}

TEST_F(Clocks, Back_to_back_steps_converge_too) {
    start(-150);
    cycle(10'000, 20'000);
    EXPECT_NEAR(static_cast<double>(difference()), 0, 5);
}

TEST_F(Clocks, Sync0_pulses_come_at_their_system_times_and_run_the_firmware) {
    start(50);
    cycle(1500);
    for (unsigned i = 0; i < 2; ++i) {
        const std::uint64_t now = w.read<std::uint64_t>(i, registers::dc_system_time);

        const std::uint64_t first = (now / 1'000'000 + 10) * 1'000'000 + 250'000;
        w.write<std::uint32_t>(i, registers::dc_sync0_cycle, 1'000'000);
        w.write<std::uint64_t>(i, registers::dc_start_time, first);
        w.write<std::uint16_t>(i, registers::dc_cyclic_unit_control, 0x0300);
        EXPECT_EQ(w.read<std::uint8_t>(i, 0x0984), 1) << "pending";
    }
    cycle(30);
    const auto a = w.line.controller(0).sync();
    const auto b = w.line.controller(1).sync();
    EXPECT_GT(a.pulses, 15U);
    EXPECT_TRUE(a.active);
    EXPECT_EQ(a.last_pulse_dc_ns % 1'000'000, 250'000U);
    EXPECT_EQ(a.last_pulse_dc_ns, b.last_pulse_dc_ns);
    EXPECT_NEAR(static_cast<double>(a.last_pulse_ns), static_cast<double>(b.last_pulse_ns), 10)
        << "at the same moment";
    EXPECT_TRUE(std::is_sorted(firmware[1].times.begin(), firmware[1].times.end()));
    EXPECT_NE(std::find(firmware[1].times.begin(), firmware[1].times.end(), b.last_pulse_ns),
              firmware[1].times.end());
    w.write<std::uint8_t>(0, registers::dc_activation, 0);
    cycle(3);
    EXPECT_EQ(w.line.controller(0).sync().pulses, a.pulses + 1) << "one while the stop was sent";
    EXPECT_FALSE(w.line.controller(0).sync().active);
}

TEST_F(Clocks, Start_time_in_the_past_gives_no_pulse_with_64_bits_and_waits_with_32) {
    start(0, false);
    for (unsigned i = 0; i < 2; ++i) {
        w.write<std::uint32_t>(i, registers::dc_sync0_cycle, 1'000'000);
        w.write<std::uint64_t>(i, registers::dc_start_time,
                               w.read<std::uint32_t>(i, registers::dc_system_time) + 3'000'000U);
        w.write<std::uint16_t>(i, registers::dc_cyclic_unit_control, 0x0300);
    }
    EXPECT_EQ(w.read<std::uint8_t>(0, 0x0984), 4) << "32 bits are in the past of a 64-bit clock";
    cycle(20);
    EXPECT_EQ(w.line.controller(0).sync().pulses, 0U);
    EXPECT_GT(w.line.controller(1).sync().pulses, 10U);
    EXPECT_EQ(w.read<std::uint64_t>(1, registers::dc_system_time) >> 32, 0U);
}

TEST_F(Clocks, Sync1_follows_sync0) {
    start(0);
    w.write<std::uint64_t>(1, registers::dc_sync0_cycle, std::uint64_t{250'000} << 32 | 1'000'000);
    w.write<std::uint64_t>(1, registers::dc_start_time,
                           w.read<std::uint64_t>(1, registers::dc_system_time) + 2'000'000);
    w.write<std::uint16_t>(1, registers::dc_cyclic_unit_control, 0x0700);
    firmware[1].times.clear();
    cycle(10);
    const auto last = w.line.controller(1).sync().last_pulse_ns;
    const auto ran_at = [&](std::int64_t ns) {
        return std::any_of(firmware[1].times.begin(), firmware[1].times.end(),
                           [&](std::int64_t t) { return std::abs(t - ns) < 20; });
    };
    EXPECT_TRUE(ran_at(last - 1'000'000));
    EXPECT_TRUE(ran_at(last - 750'000));
    EXPECT_FALSE(ran_at(last - 500'000));
    EXPECT_EQ(w.line.controller(1).sync().sync1_cycle_ns, 250'000U);
}

TEST_F(Clocks, Latch_keeps_the_system_time_of_an_edge_until_it_is_read) {
    start(0);
    w.write<std::uint8_t>(0, 0x09a8, 1);  // single event
    auto& clock = w.line.controller(0).clock();
    clock.latch(0, true, w.now_ns);
    const auto at = clock.system_time(w.now_ns);
    clock.latch(0, true, w.now_ns + 500);
    EXPECT_EQ(w.read<std::uint8_t>(0, 0x09ae), 1);
    EXPECT_EQ(w.read<std::int64_t>(0, 0x09b0), at);
    EXPECT_EQ(w.read<std::uint8_t>(0, 0x09ae), 0);
}

TEST(LineOnSegments, Answers_on_a_segment_in_memory_and_across_a_ring) {
    namespace eth = hal::ethernet;
    World w;
    for (int i = 0; i < 3; ++i) {
        w.line.add({.sii = image()});
    }
    w.line.power_on(0);
    auto master = eth::open("sim:esc-line-a", {.types = {ethertype}, .promiscuous = true});

    auto device = eth::open("sim:esc-line-a", {.promiscuous = true});
    auto second = eth::open("sim:esc-line-b", {.types = {ethertype}, .promiscuous = true});

    auto device2 = eth::open("sim:esc-line-b", {.promiscuous = true});
    ASSERT_TRUE(master && device && second && device2);
    esc::LineOnSegments served(w.line, *device.port, device2.port.get());
    ASSERT_TRUE(served.connected());
    // Returns the working counters that arrive at the master's two ports, -1: no frame.
    const auto round = [&](std::int64_t now) {
        FrameWriter writer(w.frame, {2, 0, 0, 0, 0, 1});
        writer.add(Command::brd, 3, 0, 2);
        EXPECT_EQ(master.port->send(writer.finish(), {}, now), eth::Sent::queued);
        const auto take = [&](eth::Port& port) {
            std::optional<eth::Arrival> arrival;
            for (std::int64_t t = now + 1; !arrival && t < now + 100'000; t += 5'000) {
                arrival = port.receive(t);
            }
            if (!arrival) return -1;
            EXPECT_LT(arrival->time_ns - now, 20'000);
            std::copy(arrival->bytes.begin(), arrival->bytes.end(), w.frame.begin());
            const auto d = FrameReader({w.frame.data(), arrival->bytes.size()}).next();
            return d ? static_cast<int>(d->wkc()) : -2;
        };
        const int at_first = take(*master.port);
        return std::pair{at_first, take(*second.port)};
    };
    EXPECT_EQ(round(1'000'000), (std::pair{3, -1}));
    ASSERT_TRUE(w.line.close_ring(2, 1));
    EXPECT_EQ(round(2'000'000), (std::pair{-1, 3}));
    w.line.set_cable(1, 1, false);
    EXPECT_EQ(round(3'000'000), (std::pair{2, -1}));
}

}  // namespace
