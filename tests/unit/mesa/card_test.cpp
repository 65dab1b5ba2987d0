// SPDX-License-Identifier: MIT
// The emulated card, spoken to as a driver does.
#include <algorithm>
#include <cmath>
#include <optional>

#include "mesa/card/card_server.hpp"
#include "mesa/hostmot2/formulas.hpp"
#include "mesa/hostmot2/pin.hpp"
#include "mesa/hostmot2/registers.hpp"
#include "mesa/lbp16/spaces.hpp"
#include "tests/unit/bytes_text.hpp"

namespace hal::mesa {
namespace {

using test::hex;

constexpr std::uint32_t clock_hz = 100'000'000;
constexpr std::array<std::uint8_t, 6> mac{0x02, 1, 2, 3, 4, 5};
constexpr std::int64_t ms = 1'000'000;

/// A card of a configuration, and its registers.
struct Bench {
    explicit Bench(const std::string& text) : result(read_card(text, "test.mesa")) {
        EXPECT_TRUE(result.good()) << text::errors_text(result.messages, "test.mesa");
        card.emplace(result.card, mac);
        card->advance(0);
    }
    /// Turns the pins of all modules on: outputs of modules, nothing else.
    void enable_pins() {
        for (std::uint16_t port = 0; port < result.card.model->ports; ++port) {
            const auto at = [&](unsigned reg) {
                return static_cast<std::uint16_t>(0x1000 + reg * 0x100 + port * 4);
            };
            card->write(at(ioport::source), 0x1ffff);
            card->write(at(ioport::direction), 0x1ffff);
        }
    }
    void set_times(unsigned unit, std::uint32_t clocks) {
        for (unsigned reg = stepgen::direction_setup; reg <= stepgen::pulse_space; ++reg) {
            card->write(static_cast<std::uint16_t>(0x2000 + reg * 0x100 + unit * 4), clocks);
        }
    }
    void set_rate(unsigned unit, double steps_per_s) {
        card->write(static_cast<std::uint16_t>(0x2000 + unit * 4),
                    static_cast<std::uint32_t>(step_rate(steps_per_s, clock_hz)));
    }
    double steps(unsigned unit) {
        const std::uint32_t value = card->read(static_cast<std::uint16_t>(0x2100 + unit * 4));
        return static_cast<std::int32_t>(value) / accumulator_per_step;
    }
    std::vector<std::uint8_t> ask(const Request& request) {
        std::vector<std::uint8_t> reply(max_datagram);
        reply.resize(card->execute(request.bytes(), reply));
        EXPECT_EQ(reply.size(), request.reply_size());
        return reply;
    }

    CardReadResult result;
    std::optional<EmulatedCard> card;
};

std::string with_motor(const char* type, const char* keys = "") {
    return std::string("[card]\ntype = ") + type + "\n[motor x]\nstepgen = 0\nscale = 200\n" + keys;
}

TEST(EmulatedCard, Identity_is_read_as_a_driver_reads_it) {
    Bench bench("[card]\ntype = 7i92\n");
    Request request;
    request.read(Space::hostmot2, cookie_address, Unit::u32, 4);
    request.read(Space::card, card::name, Unit::u16, 8);
    request.read(Space::eeprom, eeprom::mac, Unit::u16, 3);
    const auto reply = bench.ask(request);
    EXPECT_EQ(hex(std::span(reply).first(16)), "FE CA AA 55 48 4F 53 54 4D 4F 54 32 00 04 00 00");
    EXPECT_EQ(std::string(reply.begin() + 16, reply.begin() + 20), "7I92");
    EXPECT_EQ(hex(std::span(reply).subspan(32)), "05 04 03 02 01 02");
}

TEST(EmulatedCard, Descriptors_of_every_card_are_what_drivers_accept) {
    for (const CardModel& model : card_models()) {
        Bench bench("[card]\ntype = " + std::string(model.type) + "\n");
        std::vector<std::uint8_t> bytes(Idrom::size);
        for (std::size_t n = 0; n < bytes.size(); n += 4) {
            store(bytes.data() + n, bench.card->read(static_cast<std::uint16_t>(0x400 + n)));
        }
        const auto idrom = Idrom::decode(bytes);
        ASSERT_TRUE(idrom);
        EXPECT_EQ(fault_of(*idrom, 0x400), IdromFault::none) << model.type;
        unsigned modules = 0;
        for (std::uint16_t at = 0x440;; at = static_cast<std::uint16_t>(at + 12), ++modules) {
            for (std::uint16_t n = 0; n < 12; n += 4) {
                store(bytes.data() + n, bench.card->read(static_cast<std::uint16_t>(at + n)));
            }
            const auto module = ModuleDescriptor::decode(bytes);
            if (module->tag == Tag::none) break;
            if (module->tag == Tag::mux_select) continue;
            const ModuleKind* kind = kind_of(module->tag);
            ASSERT_NE(kind, nullptr);
            EXPECT_EQ(fault_of(*module, *kind, *idrom), ModuleFault::none) << kind->name;
        }
        const auto is_there = [&](const ModuleDescriptor& module) {
            return bench.result.card.instances(module.tag) > 0;
        };
        EXPECT_EQ(modules, std::ranges::count_if(model.modules, is_there)) << model.type;
        for (std::size_t pin = 0; pin < model.descriptors.size(); ++pin) {
            const auto word = bench.card->read(static_cast<std::uint16_t>(0x600 + pin * 4));
            EXPECT_EQ(word >> 24, 3U) << model.type << " pin " << pin;
        }
    }
}

TEST(EmulatedCard, Request_of_writes_only_has_no_reply_and_unmapped_registers_are_0) {
    Bench bench("[card]\ntype = 7i92\n");
    Request request;
    request.write32(0x0000, 0xffffffff);
    request.write32(0xff00, 0xffffffff);
    EXPECT_TRUE(bench.ask(request).empty());
    EXPECT_EQ(bench.card->read(0x0000), 0U);
    EXPECT_EQ(bench.card->read(0xff00), 0U);
}

TEST(EmulatedCard, Steps_move_the_motor_as_far_as_the_accumulator_counts) {
    Bench bench(with_motor("7i92"));
    bench.enable_pins();
    bench.set_times(0, 100);
    bench.set_rate(0, 10'000.0);
    bench.card->advance(1000 * ms);
    EXPECT_NEAR(bench.steps(0), 10'000.0, 1.0);
    EXPECT_NEAR(bench.card->plant().position(0), 50.0, 0.01);
    bench.set_rate(0, -5'000.0);
    bench.card->advance(3000 * ms);
    EXPECT_NEAR(bench.steps(0), 0.0, 2.0);
    EXPECT_NEAR(bench.card->plant().position(0) * 200, std::floor(bench.steps(0)), 1.0);
}

TEST(EmulatedCard, Rate_above_what_the_pulses_allow_loses_no_step_but_falls_behind) {
    Bench bench(with_motor("7i92"));
    bench.enable_pins();
    bench.set_times(0, 0x3fff);  // 163.83 us each: 3,052 steps/s
    bench.set_rate(0, 20'000.0);
    bench.card->advance(1000 * ms);
    EXPECT_NEAR(bench.steps(0), 3052.0, 3.0);
    EXPECT_NEAR(bench.card->plant().position(0) * 200, bench.steps(0), 1.0);
}

TEST(EmulatedCard, Motor_stands_unless_direction_and_source_of_its_pins_are_set) {
    Bench bench(with_motor("7i92"));
    bench.set_times(0, 100);
    bench.set_rate(0, 1000.0);
    bench.card->advance(100 * ms);
    EXPECT_EQ(bench.card->plant().position(0), 0.0);
    bench.card->write(0x1100, 0x1ffff);
    bench.card->advance(200 * ms);
    EXPECT_EQ(bench.card->plant().position(0), 0.0);
    bench.card->write(0x1200, 0x1ffff);
    bench.card->advance(300 * ms);
    EXPECT_NEAR(bench.card->plant().position(0), 0.5, 0.01);
}

TEST(EmulatedCard, Mechanical_stop_swallows_steps) {
    Bench bench(with_motor("7i92", "max = 1\n"));
    bench.enable_pins();
    bench.set_times(0, 100);
    bench.set_rate(0, 1000.0);
    bench.card->advance(1000 * ms);
    EXPECT_EQ(bench.card->plant().position(0), 1.0);
    EXPECT_NEAR(static_cast<double>(bench.card->plant().lost_steps(0)), 800.0, 1.0);
}

TEST(EmulatedCard, Watchdog_bites_once_stops_the_pins_and_not_the_step_generators) {
    Bench bench(with_motor("7i92"));
    bench.enable_pins();
    bench.set_times(0, 100);
    bench.set_rate(0, 1000.0);
    bench.card->write(0x0c00, watchdog_timeout(20e6, clock_hz));
    for (std::int64_t at = 1; at <= 100; ++at) {
        bench.card->write(0x0e00, watchdog::reload);
        bench.card->advance(at * ms);
    }
    EXPECT_FALSE(bench.card->has_bitten());
    bench.card->advance(1000 * ms);
    EXPECT_EQ(bench.card->read(0x0d00), 1U);
    EXPECT_EQ(bench.card->bites(), 1U);
    EXPECT_EQ(bench.card->read(0x1100), 0U);
    EXPECT_EQ(bench.card->read(0x1200), 0x1ffffU);
    EXPECT_NEAR(bench.steps(0), 1000.0, 1.0);
    EXPECT_NEAR(bench.card->plant().position(0) * 200, 119.0, 2.0);  // 99 + 20 ms
    bench.card->write(0x0e00, watchdog::reload);
    EXPECT_EQ(bench.card->read(0x0d00), 1U) << "a reload does not clear the status";
    bench.card->advance(2000 * ms);
    EXPECT_EQ(bench.card->bites(), 2U);
    bench.card->write(0x0d00, 0);
    EXPECT_EQ(bench.card->read(0x0d00), 0U);
}

TEST(EmulatedCard, Timeout_of_1_bites_at_once) {
    Bench bench("[card]\ntype = 7i92\n");
    bench.card->write(0x0c00, watchdog::bite_now);
    bench.card->advance(1000);
    EXPECT_TRUE(bench.card->has_bitten());
}

TEST(EmulatedCard, Encoder_counts_edges_with_time_stamps_and_latches_at_the_index) {
    Bench bench(
        with_motor("7i92", "encoder = 1\nencoder-scale = 1000\nindex-every = 5\nstart = 1\n"));
    bench.enable_pins();
    bench.set_times(0, 10);
    bench.card->write(0x3200, timestamp_divider(2e6, clock_hz));
    bench.card->write(0x3104, 0x0800 | encoder::latch_on_index | encoder::just_once);
    bench.set_rate(0, 2000.0);  // 10 units/s, 10000 edges/s
    bench.card->advance(200 * ms);
    const std::uint32_t early = bench.card->read(0x3004);
    EXPECT_NEAR(early & 0xffff, 2000.0, 6.0);
    EXPECT_NE(bench.card->read(0x3104) & encoder::latch_on_index, 0U);
    bench.card->advance(1000 * ms);
    const std::uint32_t control = bench.card->read(0x3104);
    EXPECT_EQ(control & encoder::latch_on_index, 0U);
    EXPECT_EQ(control >> 16, 4000U);
    const std::uint32_t late = bench.card->read(0x3004);
    EXPECT_NEAR(late & 0xffff, 10'000.0, 6.0);
    EXPECT_EQ(bench.card->read(0x3300), 2'000'000U % 65536);
    const auto age = static_cast<std::uint16_t>(bench.card->read(0x3300) - (late >> 16));
    EXPECT_LE(age, 1000U) << "the newest edge is at most a step old";
}

TEST(EmulatedCard, Switch_opens_and_closes_where_the_motor_is) {
    Bench bench(with_motor("7i92",
                           "min = -5\n[switch home]\nmotor = x\nbelow = -1\nterminal = gpio 33\n"
                           "[switch end]\nmotor = x\nbelow = -2\nnormally-closed = yes\n"
                           "terminal = gpio 32\n"));
    const auto home = [&] { return bench.card->read(0x1004) >> 16 & 1U; };
    const auto end = [&] { return bench.card->read(0x1004) >> 15 & 1U; };
    bench.card->write(0x1100, 0x3ff);
    bench.card->write(0x1200, 0x3ff);
    bench.set_times(0, 100);
    EXPECT_EQ(home(), 0U);
    EXPECT_EQ(end(), 1U);
    bench.set_rate(0, -2000.0);
    bench.card->advance(99 * ms);
    EXPECT_EQ(home(), 0U);
    bench.card->advance(110 * ms);
    EXPECT_EQ(home(), 1U);
    EXPECT_EQ(end(), 1U);
    bench.card->advance(210 * ms);
    EXPECT_EQ(home(), 1U);
    EXPECT_EQ(end(), 0U);
}

TEST(EmulatedCard, Phase_loop_shows_the_error_in_the_fraction_of_the_period) {
    Bench bench("[card]\ntype = 7i76e\n");
    const DpllRate rate = dpll_rate(1000.0, bench.card->read(0x7300) & 0xff, clock_hz);
    EXPECT_EQ(rate.prescale, 24U);
    bench.card->write(0x7200, rate.prescale << 24);
    bench.card->write(0x7000, rate.base);
    bench.card->write(0x7100, 0);
    bench.card->advance(1000 * ms + 10'000);
    EXPECT_NEAR(dpll_phase_us(bench.card->read(0x7600), 1000.0), 10.0, 0.1);
    bench.card->advance(2000 * ms - 20'000);
    EXPECT_NEAR(dpll_phase_us(bench.card->read(0x7600), 1000.0), -20.0, 0.1) << "free running";
    bench.card->write(0x7200, rate.prescale << 24 | 0x400000);
    for (int n = 0; n < 200; ++n) {
        bench.card->advance((2001 + n) * ms - 20'000);
        bench.card->read(0x7600);
    }
    EXPECT_NEAR(dpll_phase_us(bench.card->read(0x7600), 1000.0), 0.0, 0.1) << "locked";
}

TEST(EmulatedCard, Timer_latches_the_accumulator_before_the_read) {
    Bench bench(with_motor("7i76e"));
    bench.enable_pins();
    bench.set_times(0, 10);
    const DpllRate rate = dpll_rate(1000.0, 42, clock_hz);
    bench.card->write(0x7200, rate.prescale << 24);
    bench.card->write(0x7000, rate.base);
    bench.card->write(0x7400, dpll_timer(-100.0, 1000.0));
    bench.card->write(0x7100, 0);
    bench.card->write(0x2a00, stepgen::dpll_select(1));
    bench.set_rate(0, 100'000.0);
    bench.card->advance(10 * ms);
    EXPECT_NEAR(bench.steps(0), 990.0, 1.0);
}

TEST(EmulatedCard, Pwm_drives_the_spindle_whose_encoder_turns) {
    Bench bench(
        "[card]\ntype = 7i96s\n[spindle s]\ndrive = pwm 0\nmax-speed = 6000\n"
        "time-constant = 50ms\nencoder = 0\nedges = 400\n");
    bench.enable_pins();
    bench.card->write(0x4200, 3);
    bench.card->write(0x4100, pwm_value(-0.5, 12));
    bench.card->advance(500 * ms);
    EXPECT_EQ(bench.card->plant().rpm(0), 0.0) << "not enabled";
    bench.card->write(0x4500, 1);
    bench.card->advance(2500 * ms);
    EXPECT_NEAR(bench.card->plant().rpm(0), -3000.0, 3.0);
    const auto before = static_cast<std::uint16_t>(bench.card->read(0x3000));
    bench.card->advance(3500 * ms);
    const auto after = static_cast<std::uint16_t>(bench.card->read(0x3000));
    EXPECT_NEAR(static_cast<std::int16_t>(after - before), -20'000.0, 30.0);
}

TEST(EmulatedCard, Isolated_terminals_of_a_7i96s_are_read_and_driven) {
    Bench bench(
        "[card]\ntype = 7i96s\n[input button]\nterminal = inm 3\n"
        "[output coolant]\nterminal = ssr 1\n[output lamp]\nterminal = outm 4\n");
    EXPECT_EQ(bench.card->read(0x8700), 0U);
    EXPECT_EQ(bench.card->read(0x8500) & 0x1f, 10U) << "eleven inputs";
    bench.card->set_input(0, true);
    bench.card->advance(ms);
    EXPECT_EQ(bench.card->read(0x8700), 8U);
    bench.card->write(0x7d00, 2);
    bench.card->write(0xb000, 0x10);
    EXPECT_FALSE(bench.card->output(0));
    EXPECT_FALSE(bench.card->output(1));
    bench.enable_pins();
    EXPECT_FALSE(bench.card->output(0)) << "the rate enables the relays";
    EXPECT_TRUE(bench.card->output(1));
    bench.card->write(0x7e00, ssr::rate_enable | ssr_rate(1e6, clock_hz));
    EXPECT_TRUE(bench.card->output(0));
    bench.card->bite();
    EXPECT_FALSE(bench.card->output(0));
}

TEST(EmulatedCard, Power_cycle_resets_the_registers_and_not_the_machine) {
    Bench bench(with_motor("7i92"));
    bench.enable_pins();
    bench.set_times(0, 100);
    bench.set_rate(0, 1000.0);
    Request request;
    const std::uint8_t number[] = {7, 0, 0, 0};
    request.write(Space::timers, timers::read_count, Unit::u16, number);
    bench.ask(request);
    bench.card->advance(1000 * ms);
    request.clear();
    request.read(Space::timers, timers::read_count, Unit::u16, 2);
    EXPECT_EQ(hex(bench.ask(request)), "07 00 00 00");
    bench.card->reset();
    EXPECT_EQ(hex(bench.ask(request)), "00 00 00 00");
    EXPECT_EQ(bench.steps(0), 0.0);
    EXPECT_EQ(bench.card->read(0x1100), 0U);
    EXPECT_NEAR(bench.card->plant().position(0), 5.0, 0.01);
}

TEST(EmulatedCard, Lbp16_of_version_2_has_no_scratch_registers) {
    Bench bench("[card]\ntype = 7i92\nlbp-version = 2\n");
    Request request;
    const std::uint8_t number[] = {7, 0, 0, 0};
    request.write(Space::timers, timers::read_count, Unit::u16, number);
    request.read(Space::timers, timers::read_count, Unit::u16, 2);
    EXPECT_EQ(hex(bench.ask(request)), "00 00 00 00");
}

TEST(EmulatedCard, Firmware_with_fewer_modules_frees_their_pins) {
    Bench bench("[card]\ntype = 7i92\nstepgens = 2\nencoders = 0\n");
    EXPECT_EQ(bench.card->read(0x600 + 4 * 4), PinDescriptor{}.encode());
    EXPECT_NE(bench.card->read(0x600 + 3 * 4), PinDescriptor{}.encode());
    EXPECT_EQ(bench.card->read(0x3000), 0U);
}

/// What answers of a server.
struct Inbox final : datagram::Replies {
    void send(std::span<const std::uint8_t> bytes, std::int64_t at_ns) noexcept override {
        all.push_back({std::vector(bytes.begin(), bytes.end()), at_ns});
    }
    struct Datagram {
        std::vector<std::uint8_t> bytes;
        std::int64_t at_ns;
    };
    std::vector<Datagram> all;
};

struct Served : Bench {
    Served() : Bench("[card]\ntype = 7i92\n"), server(*card) {
        request.read(Space::hostmot2, cookie_address, Unit::u32);
    }
    std::vector<Inbox::Datagram> ask_at(std::int64_t now_ns) {
        Inbox inbox;
        server.serve(request.bytes(), now_ns, inbox);
        return inbox.all;
    }
    void make(const char* text) {
        CardFault fault;
        EXPECT_EQ(parse_card_fault(text, fault), "");
        server.faults().push_back(fault);
    }
    CardServer server;
    Request request;
};

TEST(CardServer, Faults_do_what_they_are_named_for) {
    {
        Served s;
        s.make("drop-reply:every=2");
        EXPECT_EQ(s.ask_at(ms).size(), 1U);
        EXPECT_EQ(s.ask_at(2 * ms).size(), 0U);
        EXPECT_EQ(s.ask_at(3 * ms).size(), 1U);
        EXPECT_EQ(s.server.lost(), 1U);
        EXPECT_EQ(s.card->requests(), 3U);
    }
    {
        Served s;
        s.make("drop-request:from=1ms:for=1ms");
        EXPECT_EQ(s.ask_at(0).size(), 1U);
        EXPECT_EQ(s.ask_at(ms).size(), 0U);
        EXPECT_EQ(s.ask_at(2 * ms).size(), 1U);
        EXPECT_EQ(s.card->requests(), 2U);
    }
    {
        Served s;
        s.make("delay:delay=3ms");
        EXPECT_EQ(s.ask_at(5 * ms).at(0).at_ns, 8 * ms);
    }
    {
        Served s;
        s.make("duplicate");
        EXPECT_EQ(s.ask_at(0).size(), 2U);
    }
    {
        Served s;
        s.make("wrong-length");
        EXPECT_EQ(s.ask_at(0).at(0).bytes.size(), 3U);
    }
    {
        Served s;
        EXPECT_EQ(hex(s.ask_at(0).at(0).bytes), "FE CA AA 55");
        s.make("wrong-cookie");
        EXPECT_EQ(hex(s.ask_at(ms).at(0).bytes), "01 35 55 AA");
    }
    {
        Served s;
        s.make("bite:from=5ms");
        s.ask_at(ms);
        EXPECT_FALSE(s.card->has_bitten());
        s.server.advance(6 * ms);
        s.server.advance(9 * ms);
        EXPECT_EQ(s.card->bites(), 1U);
    }
}

TEST(CardServer, Swapped_replies_leave_in_the_other_order) {
    Served s;
    s.make("swap:every=2");
    EXPECT_EQ(s.ask_at(0).size(), 1U);
    EXPECT_EQ(s.ask_at(ms).size(), 0U);
    EXPECT_EQ(s.ask_at(2 * ms).size(), 2U);
}

TEST(CardServer, Random_loss_is_the_same_in_each_run) {
    Served one;
    Served other;
    one.server.set_loss(0.1);
    other.server.set_loss(0.1);
    for (std::int64_t n = 0; n < 10'000; ++n) {
        EXPECT_EQ(one.ask_at(n * ms).size(), other.ask_at(n * ms).size());
    }
    EXPECT_NEAR(static_cast<double>(one.server.lost()), 1900.0, 150.0);
}

TEST(CardServer, Invalid_faults_are_rejected_with_what_to_write) {
    CardFault fault;
    EXPECT_NE(parse_card_fault("drop", fault).find("faults are drop-request"), std::string::npos);
    EXPECT_NE(parse_card_fault("delay:delay=x", fault).find("write a time"), std::string::npos);
    EXPECT_NE(parse_card_fault("delay:every=0", fault).find("every=N"), std::string::npos);
    EXPECT_NE(parse_card_fault("delay:often=1s", fault).find("options are"), std::string::npos);
}

/// Moves motor x of a 7I76E, whose step generators can latch, and arms its latch.
struct LatchBench : Bench {
    explicit LatchBench(const std::string& keys)
        : Bench("[card]\ntype = 7i76e\nstepgen-version = 0xC2\n[motor x]\nscale = 200\n" + keys) {
        enable_pins();
        set_times(0, 10);
    }
    void arm(std::uint32_t bits) { card->write(0x2200, bits); }
    std::uint32_t mode() { return card->read(0x2200); }
    double latched() {
        return static_cast<std::int32_t>(mode() & stepgen::latch_mask) / accumulator_per_step;
    }
};

TEST(EmulatedCard, Step_generator_latches_the_index_of_its_motor_once) {
    LatchBench bench("index-every = 5\n");
    bench.arm(stepgen::latch_on_index | stepgen::index_polarity);
    bench.set_rate(0, 10'000.0);
    bench.card->advance(99 * ms);
    EXPECT_EQ(bench.mode(), stepgen::latch_on_index | stepgen::index_polarity);
    bench.card->advance(110 * ms);
    EXPECT_EQ(bench.mode() & 0xffU, stepgen::index_polarity);
    EXPECT_EQ(bench.latched(), 1000.0);
    bench.card->advance(310 * ms);
    EXPECT_EQ(bench.latched(), 1000.0);
    // the falling edge is a step behind it, also backwards
    bench.arm(stepgen::latch_on_index);
    bench.card->advance(410 * ms);
    EXPECT_EQ(bench.latched(), 4001.0);
    bench.set_rate(0, -10'000.0);
    bench.arm(stepgen::latch_on_index);
    bench.card->advance(440 * ms);
    EXPECT_NEAR(bench.latched(), 4000.0, 1.01 / 256);
}

TEST(EmulatedCard, Step_generator_latches_its_probe) {
    LatchBench bench("[switch touch]\nmotor = x\nabove = 2\nterminal = gpio 18\n");
    bench.arm(stepgen::latch_on_probe | stepgen::probe_polarity);
    bench.set_rate(0, 10'000.0);
    bench.card->advance(60 * ms);
    EXPECT_EQ(bench.latched(), 401.0);
    bench.arm(stepgen::latch_on_probe);
    bench.set_rate(0, -10'000.0);
    bench.card->advance(90 * ms);
    EXPECT_NEAR(bench.latched(), 401.0, 1.01 / 256);
}

TEST(EmulatedCard, Step_generator_latches_at_a_button) {
    LatchBench bench("[input touch]\nterminal = gpio 18\n");
    bench.card->advance(1 * ms);
    bench.arm(stepgen::latch_on_probe | stepgen::probe_polarity);
    bench.set_rate(0, 10'000.0);
    bench.card->advance(11 * ms);
    EXPECT_EQ(bench.mode(), stepgen::latch_on_probe | stepgen::probe_polarity);
    bench.card->set_input(0, true);
    bench.card->advance(12 * ms);
    bench.card->advance(13 * ms);
    EXPECT_NEAR(bench.latched(), 110.0, 1.0);
}

TEST(EmulatedCard, Firmware_without_a_latch_has_no_pins_for_it) {
    Bench bench(with_motor("7i76e"));
    bench.card->write(0x2200, stepgen::latch_on_index);
    EXPECT_EQ(bench.card->read(0x2200), 0U);
    EXPECT_EQ(bench.card->read(0x0600 + 17 * 4), PinDescriptor{}.encode());
}

TEST(EmulatedCard, Multiplexed_encoders_count_and_latch_their_probe) {
    Bench bench(
        "[card]\ntype = 7i95\nencoder-version = 0x84\n[motor x]\nscale = 200\nencoder = 3\n"
        "[input touch]\nterminal = gpio 53\n");
    bench.enable_pins();
    for (std::uint16_t port = 0; port < 2; ++port) {
        bench.card->write(static_cast<std::uint16_t>(0x1100 + port * 4), 0x1fffffff);
        bench.card->write(static_cast<std::uint16_t>(0x1200 + port * 4), 0x1fffffff);
    }
    bench.set_times(0, 10);
    bench.card->advance(1 * ms);
    bench.card->write(0x360c,
                      encoder::latch_on_probe | encoder::probe_polarity | encoder::just_once);
    bench.set_rate(0, 2000.0);
    bench.card->advance(101 * ms);
    EXPECT_NEAR(bench.card->read(0x350c) & 0xffffU, 1000.0, 5.0);
    bench.card->set_input(0, true);
    bench.card->advance(102 * ms);
    const std::uint32_t control = bench.card->read(0x360c);
    EXPECT_EQ(control & encoder::latch_on_probe, 0U);
    EXPECT_NEAR(control >> 16, 1010.0, 10.0);
}

TEST(EmulatedCard, Fault_input_switches_a_bridge_off_until_it_is_enabled_again) {
    Bench bench(
        "[card]\ntype = 7i76e\n3pwmgens = 1\n[input overcurrent]\nterminal = gpio 42\n"
        "initial = yes\n[output enable]\nterminal = gpio 41\n[output high-a]\nterminal = gpio 35\n"
        "[output low-a]\nterminal = gpio 38\n");
    bench.enable_pins();
    bench.card->write(0x4500, three_phase_value(0.5, 0.0, 0.0));
    EXPECT_TRUE(bench.card->output(0)) << "active low";
    bench.card->write(0x4600, three_phase_pwm::is_enabled);
    EXPECT_FALSE(bench.card->output(0));
    EXPECT_TRUE(bench.card->output(1));
    EXPECT_FALSE(bench.card->output(2));
    bench.card->write(0x4500, three_phase_value(-0.5, 0.0, 0.0));
    EXPECT_FALSE(bench.card->output(1));
    EXPECT_TRUE(bench.card->output(2));
    bench.card->set_input(0, false);
    bench.card->advance(1 * ms);
    EXPECT_EQ(bench.card->read(0x4600), three_phase_pwm::has_fault);
    EXPECT_TRUE(bench.card->output(0));
    EXPECT_FALSE(bench.card->output(2));
    bench.card->write(0x4600, three_phase_pwm::is_enabled);
    EXPECT_EQ(bench.card->read(0x4600), three_phase_pwm::has_fault) << "it lasts";
    bench.card->set_input(0, true);
    bench.card->advance(2 * ms);
    EXPECT_EQ(bench.card->read(0x4600), three_phase_pwm::has_fault) << "until the next write";
    bench.card->write(0x4600, three_phase_pwm::is_enabled);
    EXPECT_EQ(bench.card->read(0x4600), three_phase_pwm::is_enabled);
}

TEST(CardConfig, Versions_of_encoders_are_those_of_the_card) {
    const auto errors = [](const std::string& keys) {
        const CardReadResult result = read_card("[card]\n" + keys, "test.mesa");
        return text::errors_text(result.messages, "test.mesa");
    };
    EXPECT_EQ(errors("type = 7i76e\nencoder-version = 0x83\n"), "");
    EXPECT_EQ(errors("type = 7i95\nencoder-version = 132\n"), "");
    const std::string muxed = errors("type = 7i95\nencoder-version = 0x83\n");
    EXPECT_NE(muxed.find("this card has no encoders of this version"), muxed.npos) << muxed;
    EXPECT_NE(muxed.find("write encoder-version = 2, 3, 4 or 0x84"), muxed.npos) << muxed;
    const std::string plain = errors("type = 7i92\nencoder-version = 4\n");
    EXPECT_NE(plain.find("write encoder-version = 2, 3 or 0x83"), plain.npos) << plain;
    const std::string unknown = errors("type = 7i92\nstepgen-version = 3\n");
    EXPECT_NE(unknown.find("write 0, 1, 2, 0x42 or 0xC2"), unknown.npos) << unknown;
}

}  // namespace
}  // namespace hal::mesa
