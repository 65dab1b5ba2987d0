// SPDX-License-Identifier: MIT
// The driver without pins: the config string, the probe, the datagrams of a cycle, positions.
#include <gtest/gtest.h>

#include <cmath>

#include "mesa/driver/card_image.hpp"
#include "mesa/driver/card_monitor.hpp"
#include "mesa/driver/cycle_link.hpp"
#include "mesa/driver/edge_velocity.hpp"
#include "mesa/driver/outgoing.hpp"
#include "mesa/driver/position_counter.hpp"
#include "mesa/driver/step_control.hpp"
#include "mesa/hostmot2/registers.hpp"
#include "tests/unit/mesa/register_card.hpp"

namespace hal::mesa {
namespace {

using test::RegisterCard;

std::string problem_of(std::string_view text) {
    ConfigString config;
    const ConfigString::Problem problem = config.parse(text);
    return problem.help.empty() ? problem.text : problem.text + "; " + problem.help;
}

TEST(ConfigString, Parses_the_items_of_hostmot2) {
    ConfigString config;
    EXPECT_EQ(config
                  .parse("num_encoders=1  num_stepgens=3 sserial_port_0=01xx enable_raw "
                         "num_pktuarts=0 num_leds=-1")
                  .text,
              "");
    EXPECT_EQ(config.count(Tag::encoder), 1);
    EXPECT_EQ(config.count(Tag::muxed_encoder), 1);
    EXPECT_EQ(config.count(Tag::stepgen), 3);
    EXPECT_EQ(config.count(Tag::pwm), ConfigString::all);
    EXPECT_EQ(config.count(Tag::led), ConfigString::all);
    EXPECT_TRUE(config.enable_raw());
    ConfigString numbered;
    EXPECT_EQ(numbered.parse("enable_raw=1").text, "");
    EXPECT_TRUE(numbered.enable_raw());
    EXPECT_EQ(numbered.parse("enable_raw=0").text, "");
    EXPECT_FALSE(numbered.enable_raw());
    EXPECT_EQ(config.serial_mode(0, 0), 0);
    EXPECT_EQ(config.serial_mode(0, 1), 1);
    EXPECT_EQ(config.serial_mode(0, 2), -1);
    EXPECT_EQ(config.serial_mode(0, 4), 0);
    EXPECT_EQ(config.serial_mode(1, 0), 0);
    EXPECT_EQ(config.serial_mode(4, 0), -1);
}

TEST(ConfigString, Names_what_is_wrong) {
    EXPECT_EQ(problem_of("num_stepgen=3"),
              "unknown item 'num_stepgen' in config=; did you mean 'num_stepgens'?");
    EXPECT_EQ(problem_of("colour=3"),
              "unknown item 'colour' in config=; items are num_encoders=N, num_stepgens=N, "
              "num_pwmgens=N, sserial_port_0=MODES and their like; see: hal doc mesa");
    EXPECT_EQ(problem_of("num_stepgens=x"),
              "invalid number 'x' of num_stepgens; write how many are used, or -1 for all");
    EXPECT_EQ(problem_of("enable_raw=x"), "invalid enable_raw 'x'; write 1, or 0 for none");
    EXPECT_EQ(problem_of("num_oneshots=2"),
              "num_oneshots=2: this driver does not support the module; LinuxCNC's driver does: "
              "loadrt --linuxcnc hm2_eth");
    EXPECT_EQ(problem_of("num_pktuarts=2 num_uarts=1 num_3pwmgens=1"), "");
    EXPECT_EQ(
        problem_of("sserial_port_0=0y"),
        "invalid modes '0y' of sserial_port_0; write up to 8 characters, a digit for the mode "
        "of a channel, x for an unused one");
    EXPECT_EQ(problem_of("sserial_port_7=0"),
              "unknown smart-serial port in 'sserial_port_7'; ports are sserial_port_0 .. "
              "sserial_port_3");
    EXPECT_EQ(problem_of("firmware=x.bit"),
              "'firmware=x.bit': Ethernet cards keep their firmware; it is not loaded here; remove "
              "it from config=; to write another firmware: mesaflash");
}

/// A card on sim:card and a port to it.
struct ProbeTest : testing::Test {
    RegisterCard card;
    datagram::Attached attached = datagram::attach("sim:card", card);
    datagram::Opened opened = datagram::open("sim:card");

    std::string probe_problem() {
        try {
            SetupLink link(*opened.port);
            probe(link);
        } catch (const CardError& e) {
            return e.what();
        }
        return {};
    }
};

TEST_F(ProbeTest, Finds_what_a_card_has) {
    SetupLink link(*opened.port);
    const CardImage image = probe(link);
    EXPECT_EQ(image.card, "7I76E-16");
    EXPECT_EQ(image.name, "7i76e");
    EXPECT_EQ(image.pins.size(), 51U);
    ASSERT_NE(image.find(Tag::stepgen), nullptr);
    EXPECT_EQ(image.find(Tag::stepgen)->addresses.at(stepgen::accumulator, 2), 0x2108);
}

TEST_F(ProbeTest, Tries_three_times) {
    card.drops_requests = 2;
    EXPECT_EQ(probe_problem(), "");
    card.drops_requests = 3;
    EXPECT_EQ(probe_problem(),
              "sim:card: no answer from a card (3 requests, 20 ms each); the emulated card is "
              "loaded: set its faults to FALSE, drop-request, drop-reply and their like, and its "
              "loss and delay to 0");
    card.drops_replies = 2;
    EXPECT_EQ(probe_problem(), "");
}

TEST_F(ProbeTest, Names_the_component_of_a_card_that_is_not_loaded) {
    attached.attachment.reset();
    EXPECT_EQ(probe_problem(),
              "sim:card: no answer from a card (3 requests, 20 ms each); load the emulated card "
              "first: loadrt mesa_card link=sim:card");
}

TEST_F(ProbeTest, Is_not_misled_by_duplicate_answers) {
    card.copies = 2;
    EXPECT_EQ(probe_problem(), "");
}

TEST_F(ProbeTest, Names_what_is_wrong_with_a_firmware) {
    card.put(Space::hostmot2, cookie_address, std::uint32_t{0x12345678});
    EXPECT_EQ(probe_problem(),
              "sim:card (7I76E-16): wrong cookie 0x12345678 in place of 0x55AACAFE: no HostMot2 "
              "firmware is running on this device");
    card.put(Space::hostmot2, cookie_address, hostmot2_cookie);
    card.text(Space::hostmot2, firmware_name_address, "HOSTMOT3");
    EXPECT_EQ(probe_problem(),
              "sim:card (7I76E-16): unknown firmware 'HOSTMOT3'; the driver supports HOSTMOT2");
    card.text(Space::hostmot2, firmware_name_address, "HOSTMOT2");
    card.idrom.type = 7;
    card.store_tables();
    EXPECT_EQ(probe_problem(),
              "sim:card (7I76E-16): unknown firmware: IDROM type 7; the driver supports 2 and 3");
    card.idrom.type = 2;
    card.modules[2].version = 9;
    card.store_tables();
    EXPECT_EQ(probe_problem(),
              "sim:card (7I76E-16): module stepgen of the firmware has version 9; the driver "
              "supports 0, 1, 2, 0x42, 0xC2");
    card.modules[2].version = 2;
    card.modules[2].registers = 4;
    card.store_tables();
    EXPECT_EQ(probe_problem(),
              "sim:card (7I76E-16): module stepgen of the firmware has 4 registers; the driver "
              "supports 10");
    card.put(Space::card, card::lbp_version, std::uint16_t{2});
    EXPECT_EQ(probe_problem(),
              "sim:card (7I76E-16): LBP16 version 2; the driver needs version 3; to write another "
              "firmware: mesaflash");
    card.put(Space::card, card::lbp_version, std::uint16_t{3});
    card.modules = {card.modules[0]};
    card.store_tables();
    EXPECT_EQ(probe_problem(),
              "sim:card (7I76E-16): unknown firmware: it has no I/O ports or no watchdog");
}

TEST_F(ProbeTest, Names_the_versions_of_encoders) {
    card.modules.push_back({Tag::muxed_encoder, 0x85, ClockTag::low, 6, 0x3500, 5, 0x00, 0x3});
    card.store_tables();
    EXPECT_EQ(probe_problem(),
              "sim:card (7I76E-16): module muxed encoder of the firmware has version 0x85; the "
              "driver supports 2, 3, 4, 0x84");
    card.modules.back().version = 4;
    card.modules.push_back({Tag::encoder, 3, ClockTag::low, 2, 0x3000, 5, 0x00, 0x3});
    card.store_tables();
    EXPECT_EQ(probe_problem(),
              "sim:card (7I76E-16): the firmware has the modules muxed encoder and encoder; the "
              "driver supports one of this kind");
}

TEST_F(ProbeTest, Leaves_the_pins_of_modules_without_a_driver_as_GPIO) {
    card.modules.push_back({Tag{0xc0}, 1, ClockTag::low, 6, 0xc000, 5, 0x00, 0x1f});
    card.modules.push_back({Tag{0x77}, 0xc1, ClockTag::low, 1, 0xd000, 5, 0x00, 0x1f});
    card.idrom.instance_strides[1] = 0x10;
    card.modules.push_back({Tag::uart_transmit, 0, ClockTag::low, 2, 0x6000, 4, 0x10, 0x0f});
    card.modules.push_back({Tag::packet_uart_receive, 3, ClockTag::low, 1, 0x6500, 4, 0x00, 0x0f});
    card.store_tables();
    card.put_pin(20, {1, true, Tag{0xc0}, 0});
    card.put_pin(21, {1, true, Tag{0x77}, 0});
    card.put_pin(22, {1, true, Tag::uart_transmit, 0});
    SetupLink link(*opened.port);
    CardImage image = probe(link);
    ConfigString config;
    config.parse("num_uarts=2");
    EXPECT_EQ(apply(config, image), "");
    EXPECT_TRUE(image.pins[20].is_gpio);
    EXPECT_TRUE(image.pins[21].is_gpio);
    EXPECT_TRUE(image.pins[22].is_gpio);
    const std::vector<std::string> expected = {
        "module resolver (tag 0xC0, version 1, 6 instances) is not supported; its I/O pins are "
        "GPIO",
        "unknown module (tag 0x77, version 0xC1, 1 instance) is not used; its I/O pins are GPIO",
        "module UART transmit (tag 0x09, version 0, 2 instances) is not used: UARTs have no pins "
        "in HAL; its I/O pins are GPIO",
        "module packet UART receive (tag 0x1C, version 3, 1 instance) is not used: UARTs have no "
        "pins in HAL; its I/O pins are GPIO"};
    EXPECT_EQ(unused_modules(image), expected);
    config.parse("num_uarts=3");
    EXPECT_EQ(apply(config, image),
              "sim:card (7I76E-16): config asks for num_uarts=3, but the firmware has 2; without "
              "num_uarts all of them are used");
}

/// The multiplexer puts two encoders on the pins of a unit.
TEST_F(ProbeTest, Uses_the_pins_of_half_as_many_units_as_multiplexed_encoders) {
    card.modules.push_back({Tag::muxed_encoder, 4, ClockTag::low, 6, 0x3500, 5, 0x00, 0x3});
    card.modules.push_back({Tag::mux_select, 0, ClockTag::low, 1, 0, 0, 0x00, 0});
    card.store_tables();
    for (std::uint8_t unit = 0; unit < 3; ++unit) {
        card.put_pin(20U + unit, {pin_number::encoder::a, false, Tag::muxed_encoder, unit});
    }
    card.put_pin(23, {1, true, Tag::mux_select, 6});
    SetupLink link(*opened.port);
    CardImage image = probe(link);
    ConfigString config;
    config.parse("num_encoders=3");
    EXPECT_EQ(apply(config, image), "");
    EXPECT_FALSE(image.pins[20].is_gpio);
    EXPECT_FALSE(image.pins[21].is_gpio);
    EXPECT_TRUE(image.pins[22].is_gpio);
    EXPECT_FALSE(image.pins[23].is_gpio);
    EXPECT_TRUE(unused_modules(image).empty());
    config.parse("num_encoders=0");
    EXPECT_EQ(apply(config, image), "");
    EXPECT_TRUE(image.pins[20].is_gpio);
    EXPECT_TRUE(image.pins[23].is_gpio);
}

TEST_F(ProbeTest, Rejects_more_pins_and_instances_than_a_register_has_bits) {
    card.idrom.ports = 1;
    card.idrom.port_width = 51;
    card.store_tables();
    EXPECT_EQ(probe_problem(),
              "sim:card (7I76E-16): unknown firmware: ports of 51 pins; the driver supports up to "
              "32");
    card.idrom.ports = 3;
    card.idrom.port_width = 17;
    card.modules[2].instances = 33;
    card.store_tables();
    EXPECT_EQ(probe_problem(),
              "sim:card (7I76E-16): module stepgen of the firmware has 33 instances; the driver "
              "supports up to 32");
    card.modules[2].instances = 3;
    card.modules[0].instances = 2;
    card.store_tables();
    EXPECT_EQ(probe_problem(),
              "sim:card (7I76E-16): unknown firmware: 3 ports, but 2 of their modules");
}

/// Bytes at random behind a valid head: the probe ends, with a card or with a sentence.
TEST_F(ProbeTest, Survives_any_contents_of_the_registers) {
    std::uint32_t random = 12345;
    const auto next = [&] {
        random = random * 1664525U + 1013904223U;
        return random >> 8;
    };
    int rejected = 0;
    for (int n = 0; n < 500; ++n) {
        card.store_tables();
        for (std::uint32_t i = next() % 8; i < 8; ++i) {
            card.put(Space::hostmot2, 0x0400 + next() % 0x300, static_cast<std::uint8_t>(next()));
        }
        const std::string problem = probe_problem();
        rejected += problem.empty() ? 0 : 1;
        EXPECT_TRUE(problem.empty() || problem.starts_with("sim:card (7I76E-16): ")) << problem;
    }
    EXPECT_GT(rejected, 50);
}

TEST_F(ProbeTest, Apply_compares_the_config_with_the_card) {
    SetupLink link(*opened.port);
    CardImage image = probe(link);
    ConfigString config;
    config.parse("num_stepgens=2");
    EXPECT_EQ(apply(config, image), "");
    EXPECT_EQ(image.find(Tag::stepgen)->used, 2U);
    config.parse("num_stepgens=4");
    EXPECT_EQ(
        apply(config, image),
        "sim:card (7I76E-16): config asks for num_stepgens=4, but the firmware has 3; without "
        "num_stepgens all of them are used");
    config.parse("num_stepgens=2 num_encoders=1");
    EXPECT_EQ(apply(config, image),
              "sim:card (7I76E-16): config asks for num_encoders=1, but the firmware does not have "
              "this module");
}

/// A cycle of one register that is read and one that is written.
struct CycleTest : ProbeTest {
    CycleTest() {
        ReadLayout layout;
        value = layout.add(0x2100);
        link = std::make_unique<CycleLink>(*opened.port, layout, 0x4711);
    }
    void write(std::uint32_t number, bool requests = true) {
        Outgoing out(link->begin_write(), false);
        out.put(0x2100, number);
        link->send_write(now, requests, 0, [](Request&) {});
    }
    Answer next() {
        now += 1'000'000;
        return link->receive(now, 0);
    }
    std::unique_ptr<CycleLink> link;
    std::size_t value = 0;
    std::int64_t now = 0;
};

TEST_F(CycleTest, One_datagram_writes_and_requests) {
    write(5);
    EXPECT_EQ(card.requests, 1);
    EXPECT_EQ(next(), Answer::fresh);
    EXPECT_EQ(link->reply().at(value), 5U);
    EXPECT_TRUE(link->writes_arrived());
    EXPECT_EQ(link->age_ns(now), 1'000'000);
    write(6);
    EXPECT_EQ(next(), Answer::fresh);
    EXPECT_EQ(link->counts().requests, 2U);
    EXPECT_EQ(link->counts().lost, 0U);
}

TEST_F(CycleTest, A_request_of_its_own_shows_whether_writes_have_arrived) {
    write(5, false);
    link->request(now);
    EXPECT_EQ(next(), Answer::fresh);
    EXPECT_TRUE(link->writes_arrived());
    card.drops_requests = 1;
    write(6, false);
    link->request(now);
    EXPECT_EQ(next(), Answer::fresh);
    EXPECT_FALSE(link->writes_arrived());
    EXPECT_EQ(link->counts().lost_writes, 1U);
}

TEST_F(CycleTest, A_lost_answer_costs_one_cycle) {
    card.drops_replies = 1;
    write(5);
    EXPECT_EQ(next(), Answer::missing);
    write(6);
    EXPECT_EQ(next(), Answer::fresh);
    EXPECT_EQ(link->reply().at(value), 6U);
    EXPECT_EQ(link->counts().lost, 1U);
}

TEST_F(CycleTest, A_late_answer_is_not_taken_for_the_newest) {
    card.delay_ns = 1'500'000;
    write(5);
    EXPECT_EQ(next(), Answer::missing);
    card.delay_ns = 0;
    write(6);
    EXPECT_EQ(next(), Answer::fresh);
    EXPECT_EQ(link->reply().at(value), 6U);
    EXPECT_EQ(link->counts().unexpected, 0U);  // still under the way
    write(7);
    EXPECT_EQ(next(), Answer::fresh);
    EXPECT_EQ(link->reply().at(value), 7U);
    EXPECT_EQ(link->counts().unexpected, 1U);
}

TEST_F(CycleTest, Duplicate_answers_are_counted_and_not_used) {
    card.copies = 2;
    for (std::uint32_t n = 1; n < 10; ++n) {
        write(n);
        EXPECT_EQ(next(), Answer::fresh);
        EXPECT_EQ(link->reply().at(value), n);
    }
    EXPECT_EQ(link->counts().unexpected, 8U);
}

TEST_F(CycleTest, Shows_the_writes_of_another_master) {
    write(1);
    next();
    write(2);
    next();
    EXPECT_FALSE(link->has_foreign_writes());
    card.put(Space::timers, timers::write_count, std::uint32_t{77});
    write(3);
    EXPECT_EQ(next(), Answer::fresh);
    EXPECT_TRUE(link->has_foreign_writes());
}

TEST_F(CycleTest, Shows_that_another_program_has_sent_requests) {
    for (int n = 0; n < 3; ++n) {
        write(1);
        EXPECT_EQ(next(), Answer::fresh);
        EXPECT_FALSE(link->has_other_requests());
        write(1, false);  // a cycle of two datagrams
        link->request(now);
        EXPECT_EQ(next(), Answer::fresh);
        EXPECT_FALSE(link->has_other_requests());
    }
    Request other;
    other.write32(0x3000, 5);
    opened.port->send(other.bytes(), now);
    write(1);
    EXPECT_EQ(next(), Answer::fresh);
    EXPECT_TRUE(link->has_other_requests());
    write(1);
    EXPECT_EQ(next(), Answer::fresh);
    EXPECT_FALSE(link->has_other_requests());
    card.drops_requests = 1;
    write(1);
    EXPECT_EQ(next(), Answer::missing);
    write(1);
    EXPECT_EQ(next(), Answer::fresh);
    EXPECT_FALSE(link->has_other_requests());
}

TEST_F(CycleTest, Settings_are_written_when_they_change) {
    Setting setting(0x3000);
    Request request;
    Outgoing first(request, false);
    first.put(setting, 5);
    EXPECT_EQ(request.size(), 8U);
    Request second;
    Outgoing(second, false).put(setting, 5);
    EXPECT_EQ(second.size(), 0U);
    Request third;
    Outgoing(third, true).put(setting, 5);
    EXPECT_EQ(third.size(), 8U);
}

TEST(Outgoing, Writes_a_setting_that_did_not_fit_in_the_next_cycle) {
    Setting setting(0x3000);
    Request full;
    while (full.write32(0, 0)) {
    }
    Outgoing out(full, false);
    out.put(setting, 5);
    EXPECT_FALSE(out.is_complete());
    Request next;
    Outgoing(next, false).put(setting, 5);
    EXPECT_EQ(next.size(), 8U);
}

TEST(PositionCounter, Extends_registers_that_wrap) {
    PositionCounter<std::int16_t> counter;
    counter.update(32'000);
    EXPECT_EQ(counter.position(), 0);
    EXPECT_EQ(counter.update(-32'000), 1536);
    EXPECT_EQ(counter.update(32'000), 0);
    PositionCounter<std::int32_t> wide;
    wide.update(2'147'483'000);
    EXPECT_EQ(wide.update(-2'147'483'000), 1296);
}

TEST(PositionCounter, Follows_an_expected_movement_across_wraps) {
    PositionCounter<std::int16_t> counter;
    counter.update(0);
    // 200,000 counts in a gap, of which 199,950 are expected
    EXPECT_EQ(counter.update(static_cast<std::int16_t>(200'000), 199'950), 200'000);
    EXPECT_EQ(counter.update(static_cast<std::int16_t>(100'000), -100'020), 100'000);
}

/// Moves a generator that is commanded by its rate.
struct Axis {
    explicit Axis(double acceleration) : limits{100.0, acceleration} {}
    void follow(double command) {
        const double before = control.velocity();
        const double velocity = control.follow_position(command, position, period, limits);
        if (limits.acceleration > 0.0) {
            EXPECT_LE(std::abs(velocity - before), limits.acceleration * period * 1.000001);
        }
        position += velocity * period;
    }
    static constexpr double period = 0.001;
    StepControl control;
    StepControl::Limits limits;
    double position = 0.0;
};

TEST(StepControl, Reaches_the_command_of_a_ramp_and_stays_on_it) {
    Axis axis(500.0);
    double command = 0.0;
    double velocity = 0.0;
    for (int n = 0; n < 2000; ++n) {
        velocity = n < 500 ? std::min(velocity + 0.4, 50.0) : std::max(velocity - 0.4, 0.0);
        command += velocity * Axis::period;
        axis.follow(command);
        EXPECT_NEAR(axis.position, command, 1e-6) << n;
    }
}

TEST(StepControl, Reaches_a_step_of_the_command_without_a_limit_cycle) {
    Axis axis(500.0);
    double overshoot = 0.0;
    for (int n = 0; n < 2000; ++n) {
        axis.follow(10.0);
        overshoot = std::max(overshoot, axis.position - 10.0);
    }
    EXPECT_LT(overshoot, 70.7 * Axis::period);  // one period at the highest velocity
    EXPECT_NEAR(axis.position, 10.0, 1e-9);
    EXPECT_NEAR(axis.control.velocity(), 0.0, 1e-6);
}

TEST(StepControl, Falls_below_a_lowered_limit_within_its_acceleration) {
    StepControl control;
    StepControl::Limits limits{50.0, 1000.0};
    control.set_velocity(50.0);
    limits.velocity = 5.0;
    EXPECT_DOUBLE_EQ(control.follow_velocity(50.0, 0.0, 0.001, limits), 49.0);
    EXPECT_DOUBLE_EQ(control.follow_position(1e3, 0.0, 0.001, limits), 48.0);
    limits.possible = 30.0;
    EXPECT_DOUBLE_EQ(control.follow_velocity(50.0, 0.0, 0.001, limits), 30.0);
}

TEST(StepControl, Approaches_a_command_that_is_far_away) {
    for (const double far : {1e6, 1e12, 1e18, 1e30}) {
        for (const double sign : {1.0, -1.0}) {
            Axis axis(500.0);
            for (int n = 0; n < 300; ++n) {
                axis.follow(sign * far);
            }
            EXPECT_DOUBLE_EQ(axis.control.velocity(), sign * 100.0) << far;
        }
    }
}

TEST(StepControl, Does_not_take_the_first_command_behind_an_invalid_one_for_a_movement) {
    StepControl control;
    const StepControl::Limits limits{50.0, 1000.0};
    control.hold(std::nan(""));
    control.follow_position(7.0, 7.0, 0.001, limits);
    EXPECT_DOUBLE_EQ(control.velocity(), 0.0);
    control.brake(7.0, 0.001, limits);
    control.follow_position(7.0001, 7.0, 0.001, limits);
    EXPECT_DOUBLE_EQ(control.feed_forward(), 0.0);
    EXPECT_NEAR(control.velocity(), 0.05, 1e-9);
}

TEST(StepControl, Follows_a_velocity_within_its_limits) {
    StepControl control;
    const StepControl::Limits limits{5.0, 1000.0};
    EXPECT_DOUBLE_EQ(control.follow_velocity(20.0, 0.0, 0.001, limits), 1.0);
    for (int n = 0; n < 10; ++n) {
        control.follow_velocity(20.0, 0.0, 0.001, limits);
    }
    EXPECT_DOUBLE_EQ(control.velocity(), 5.0);
    EXPECT_DOUBLE_EQ(control.follow_velocity(std::nan(""), 0.0, 0.001, limits), 4.0);
}

TEST(EdgeVelocity, Is_exact_for_equidistant_edges) {
    EdgeVelocity speed;
    speed.restart(0);
    // 700 counts/s, ticks of 0.5 us: an edge each 2857.14 ticks, a reading each 2000
    std::int64_t edges = 0;
    for (int n = 1; n < 400; ++n) {
        const double now_s = n * 0.001;
        const auto newest = static_cast<std::int64_t>(std::floor(now_s * 700.0));
        const auto edge_ticks =
            static_cast<std::int64_t>(std::llround(static_cast<double>(newest) / 700.0 * 2e6));
        const double velocity =
            speed.update({newest - edges, static_cast<std::uint16_t>(edge_ticks),
                          static_cast<std::uint16_t>(n * 2000)},
                         2e6, 0.5);
        edges = newest;
        if (n > 10) {
            EXPECT_NEAR(velocity, 700.0, 0.5) << n;
        }
    }
}

TEST(EdgeVelocity, Decays_without_edges_and_is_0_after_the_timeout) {
    EdgeVelocity speed;
    speed.restart(0);
    std::uint16_t now = 0;
    for (int n = 0; n < 5; ++n) {
        now = static_cast<std::uint16_t>(now + 2000);
        speed.update({10, now, now}, 2e6, 0.5);
    }
    EXPECT_NEAR(speed.velocity(), 10'000.0, 1.0);
    for (int n = 1; n <= 499; ++n) {
        now = static_cast<std::uint16_t>(now + 2000);
        const double limit = 1.0 / (n * 0.001);
        EXPECT_NEAR(speed.update({0, 0, now}, 2e6, 0.5), std::min(limit, 10'000.0), limit * 1e-6);
    }
    now = static_cast<std::uint16_t>(now + 4000);
    EXPECT_EQ(speed.update({0, 0, now}, 2e6, 0.5), 0.0);
}

TEST(EdgeVelocity, Is_0_for_one_count_back_and_forth) {
    EdgeVelocity speed;
    speed.restart(0);
    std::uint16_t now = 0;
    for (int n = 0; n < 50; ++n) {
        now = static_cast<std::uint16_t>(now + 2000);
        speed.update({n % 2 == 0 ? 1 : -1, static_cast<std::uint16_t>(now - 500), now}, 2e6, 0.5);
        EXPECT_EQ(speed.velocity(), 0.0) << n;
    }
}

/// Steps of a monitor at 1 kHz.
struct MonitorTest : testing::Test {
    CardEvent good() { return monitor.step({true, true, false, false, false}, 4, 1'000'000); }
    CardEvent missing() { return monitor.step({}, 4, 1'000'000); }
    CardEvent with(bool reset, bool bitten, bool foreign = false) {
        return monitor.step({true, true, foreign, reset, bitten}, 4, 1'000'000);
    }
    void go_online() {
        good();
        ASSERT_EQ(good(), CardEvent::online);
    }
    CardMonitor monitor;
};

TEST_F(MonitorTest, Is_online_when_its_settings_have_arrived) {
    EXPECT_EQ(with(true, false), CardEvent::none);
    EXPECT_FALSE(monitor.drives_outputs());
    EXPECT_EQ(with(false, true), CardEvent::none);
    EXPECT_EQ(good(), CardEvent::online);
    EXPECT_TRUE(monitor.drives_outputs());
}

TEST_F(MonitorTest, Tolerates_missing_answers_up_to_its_limit) {
    go_online();
    for (int n = 0; n < 4; ++n) {
        EXPECT_EQ(missing(), CardEvent::none);
    }
    EXPECT_TRUE(monitor.drives_outputs());
    EXPECT_EQ(good(), CardEvent::none);
    for (int n = 0; n < 4; ++n) {
        EXPECT_EQ(missing(), CardEvent::none);
    }
    EXPECT_EQ(missing(), CardEvent::lost);
    EXPECT_FALSE(monitor.drives_outputs());
    EXPECT_EQ(missing(), CardEvent::none);
}

TEST_F(MonitorTest, Configures_a_card_that_answers_again) {
    go_online();
    for (int n = 0; n < 5; ++n) {
        missing();
    }
    EXPECT_EQ(with(false, true), CardEvent::returned);
    EXPECT_TRUE(monitor.was_off());
    EXPECT_EQ(monitor.state(), CardState::configuring);
    EXPECT_EQ(with(false, true), CardEvent::none);
    EXPECT_EQ(good(), CardEvent::online);
    for (int n = 0; n < 5; ++n) {
        missing();
    }
    EXPECT_EQ(good(), CardEvent::returned);
    EXPECT_FALSE(monitor.was_off());
}

TEST_F(MonitorTest, Recognises_a_card_that_was_reset_between_two_answers) {
    go_online();
    EXPECT_EQ(with(true, false), CardEvent::was_reset);
    EXPECT_EQ(monitor.state(), CardState::configuring);
}

TEST_F(MonitorTest, Recognises_a_reset_while_it_configures) {
    EXPECT_EQ(with(true, false), CardEvent::none);  // a card that was just switched on
    EXPECT_EQ(with(true, false), CardEvent::none);
    EXPECT_EQ(with(false, true), CardEvent::none);
    EXPECT_EQ(with(true, false), CardEvent::was_reset);
    EXPECT_EQ(with(true, false), CardEvent::none);
    EXPECT_EQ(good(), CardEvent::online);
}

TEST_F(MonitorTest, Keeps_outputs_off_after_a_bite_until_it_is_acknowledged) {
    go_online();
    EXPECT_EQ(with(false, true), CardEvent::bitten);
    for (int n = 0; n < 100; ++n) {
        EXPECT_EQ(with(false, true), CardEvent::none);
        EXPECT_FALSE(monitor.drives_outputs());
    }
    monitor.acknowledge();
    EXPECT_EQ(with(false, true), CardEvent::none);
    EXPECT_EQ(good(), CardEvent::online);
}

TEST_F(MonitorTest, A_bite_outlasts_losses_resets_and_restarts) {
    go_online();
    EXPECT_EQ(with(false, true), CardEvent::bitten);
    for (int n = 0; n < 5; ++n) {
        missing();
    }
    EXPECT_EQ(monitor.state(), CardState::lost);
    EXPECT_EQ(with(false, true), CardEvent::returned);
    EXPECT_EQ(monitor.state(), CardState::bitten);
    EXPECT_EQ(with(true, false), CardEvent::was_reset);
    EXPECT_EQ(with(true, false), CardEvent::none);
    EXPECT_EQ(monitor.state(), CardState::bitten);
    for (int n = 0; n < 5; ++n) {
        missing();
    }
    EXPECT_EQ(with(true, false), CardEvent::was_reset);
    EXPECT_EQ(monitor.state(), CardState::bitten);
    monitor.restart();
    EXPECT_EQ(good(), CardEvent::none);
    EXPECT_EQ(monitor.state(), CardState::bitten);
    for (int n = 0; n < 5; ++n) {
        missing();
    }
    monitor.acknowledge();
    EXPECT_EQ(monitor.state(), CardState::lost);
    EXPECT_EQ(good(), CardEvent::returned);
    EXPECT_EQ(good(), CardEvent::none);
    EXPECT_EQ(good(), CardEvent::online);
}

TEST_F(MonitorTest, Leaves_a_card_to_another_master_until_that_has_stopped) {
    go_online();
    EXPECT_EQ(with(false, false, true), CardEvent::contended);
    for (int n = 0; n < 50; ++n) {
        with(false, false, n % 2 == 0);
        EXPECT_EQ(monitor.state(), CardState::contended);
    }
    for (int n = 0; n < 999; ++n) {
        good();
    }
    EXPECT_EQ(monitor.state(), CardState::configuring);
}

TEST_F(MonitorTest, Recognises_a_reset_while_another_master_writes) {
    go_online();
    EXPECT_EQ(with(true, false, true), CardEvent::contended);
    EXPECT_EQ(with(true, false, true), CardEvent::was_reset);
    EXPECT_EQ(monitor.state(), CardState::configuring);
}

}  // namespace
}  // namespace hal::mesa
