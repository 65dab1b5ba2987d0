// SPDX-License-Identifier: MIT
#include <cmath>
#include <limits>

#include "mesa/hostmot2/boards.hpp"
#include "mesa/hostmot2/formulas.hpp"
#include "mesa/hostmot2/idrom.hpp"
#include "mesa/hostmot2/module.hpp"
#include "mesa/hostmot2/pin.hpp"
#include "mesa/hostmot2/registers.hpp"
#include "mesa/hostmot2/smart_serial.hpp"
#include "tests/unit/bytes_text.hpp"

namespace hal::mesa {
namespace {

using test::hex;

constexpr std::uint32_t low = 100'000'000;
constexpr std::uint32_t high = 200'000'000;

Idrom usual_idrom() {
    Idrom rom;
    rom.board = {'M', 'E', 'S', 'A', '7', 'I', '9', '2'};
    rom.ports = 2;
    rom.width = 34;
    rom.port_width = 17;
    return rom;
}

TEST(Idrom, Comes_back_as_it_went_and_has_its_fields_where_the_register_map_says) {
    const Idrom rom = usual_idrom();
    const auto bytes = rom.encode();
    EXPECT_EQ(load<std::uint32_t>(bytes.data() + 0x04), 0x40U);
    EXPECT_EQ(load<std::uint32_t>(bytes.data() + 0x08), 0x200U);
    EXPECT_EQ(bytes[0x0c], 'M');
    EXPECT_EQ(load<std::uint32_t>(bytes.data() + 0x20), 34U);
    EXPECT_EQ(load<std::uint32_t>(bytes.data() + 0x2c), high);
    EXPECT_EQ(load<std::uint32_t>(bytes.data() + 0x34), 0x40U);
    EXPECT_EQ(load<std::uint32_t>(bytes.data() + 0x3c), 0x100U);
    EXPECT_EQ(Idrom::decode(bytes), rom);
    EXPECT_FALSE(Idrom::decode(std::span(bytes).first(63)));
}

TEST(Idrom, Each_fault_is_found) {
    const auto fault = [](auto change) {
        Idrom rom = usual_idrom();
        change(rom);
        return fault_of(rom, usual_idrom_address);
    };
    EXPECT_EQ(fault([](Idrom&) {}), IdromFault::none);
    EXPECT_EQ(fault([](Idrom& r) { r.type = 4; }), IdromFault::type);
    EXPECT_EQ(fault([](Idrom& r) { r.width = 33; }), IdromFault::width);
    const auto ports = [](unsigned count) {
        return [=](Idrom& r) {
            r.ports = count;
            r.width = count * 17;
        };
    };
    EXPECT_EQ(fault(ports(0)), IdromFault::no_pins);
    EXPECT_EQ(fault(ports(58)), IdromFault::none);
    EXPECT_EQ(fault(ports(59)), IdromFault::many_pins);
    EXPECT_EQ(fault([](Idrom& r) { r.clock_low_hz = 999'999; }), IdromFault::clock);
    EXPECT_EQ(fault([](Idrom& r) { r.pins = 0xfc00; }), IdromFault::descriptors);
    EXPECT_EQ(fault([](Idrom& r) { r.modules = 0xffffffff; }), IdromFault::descriptors);
}

TEST(Module, Descriptor_has_its_bytes_and_comes_back) {
    const ModuleDescriptor module{Tag::smart_serial, 0, ClockTag::low, 1, 0x5b00, 6, 0x10, 0x3c};
    const auto bytes = module.encode();
    EXPECT_EQ(hex(bytes), "C1 00 01 01 00 5B 06 10 3C 00 00 00");
    EXPECT_EQ(ModuleDescriptor::decode(bytes), module);
    EXPECT_FALSE(ModuleDescriptor::decode(std::span(bytes).first(11)));
}

TEST(Module, Addresses_use_the_strides_that_the_descriptor_names) {
    const Idrom rom = usual_idrom();
    const ModuleAddresses stepgen({Tag::stepgen, 2, ClockTag::low, 5, 0x2000, 10, 0, 0x1ff}, rom);
    EXPECT_EQ(stepgen.at(stepgen::accumulator, 3), 0x210c);
    EXPECT_EQ(stepgen.at(stepgen::master_rate), 0x2900);
    const ModuleAddresses serial({Tag::smart_serial, 0, ClockTag::low, 2, 0x5b00, 6, 0x10, 0x3c},
                                 rom);
    EXPECT_EQ(serial.at(smart_serial::control_status, 1), 0x5d40);
}

TEST(Module, Known_modules_are_compared_with_what_a_driver_can_use) {
    const Idrom rom = usual_idrom();
    const ModuleKind& kind = *kind_of(Tag::stepgen);
    const ModuleDescriptor good{Tag::stepgen, 2, ClockTag::low, 5, 0x2000, 10, 0, 0x1ff};
    EXPECT_EQ(fault_of(good, kind, rom), ModuleFault::none);
    ModuleDescriptor bad = good;
    bad.version = 3;
    EXPECT_EQ(fault_of(bad, kind, rom), ModuleFault::version);
    bad = good;
    bad.registers = 9;
    EXPECT_EQ(fault_of(bad, kind, rom), ModuleFault::registers);
    bad = good;
    bad.strides = 0x10;
    EXPECT_EQ(fault_of(bad, kind, rom), ModuleFault::instance_stride);
    bad = good;
    bad.per_instance = 0xff;
    EXPECT_EQ(fault_of(bad, kind, rom), ModuleFault::per_instance);
    bad = good;
    bad.base = 0xf800;
    EXPECT_EQ(fault_of(bad, kind, rom), ModuleFault::outside);
    EXPECT_EQ(kind_of(Tag{0x77}), nullptr);
    EXPECT_EQ(name_of(Tag::dpll), "dpll");
    EXPECT_EQ(name_of(Tag{0xc0}), "resolver");
    EXPECT_EQ(kind_of(Tag{0xc0}), nullptr);
    EXPECT_EQ(name_of(Tag{0x77}), "?");
}

TEST(Pin, Word_has_its_fields_and_comes_back) {
    const PinDescriptor step{pin_number::stepgen::step, true, Tag::stepgen, 3, Tag::ioport};
    EXPECT_EQ(step.encode(), 0x03030581U);
    EXPECT_EQ(PinDescriptor::decode(0x03030581U), step);
    for (std::uint32_t word : {0x03000000U, 0xffffffffU, 0x0380c38aU}) {
        EXPECT_EQ(PinDescriptor::decode(word).encode(), word);
    }
}

TEST(Pin, Functions_have_the_names_of_their_modules) {
    EXPECT_EQ(function_of(PinDescriptor::decode(0x03030581)), "stepgen.03.step");
    EXPECT_EQ(function_of(PinDescriptor::decode(0x03000582)), "stepgen.00.direction");
    EXPECT_EQ(function_of(PinDescriptor::decode(0x03010401)), "encoder.01.phase-A");
    EXPECT_EQ(function_of(PinDescriptor::decode(0x03000683)), "pwmgen.00.enable");
    EXPECT_EQ(function_of(PinDescriptor::decode(0x0300c182)), "sserial.00.tx1");
    EXPECT_EQ(function_of(PinDescriptor::decode(0x0300c102)), "sserial.00.rx1");
    EXPECT_EQ(function_of(PinDescriptor::decode(0x0300c18b)), "sserial.00.txen0");
    EXPECT_EQ(function_of(PinDescriptor::decode(0x0300c301 | 0x80)), "ssr.00.out-00");
    EXPECT_EQ(function_of(PinDescriptor::decode(0x03000d81)), "encoder.00.sel0");
    EXPECT_EQ(function_of(PinDescriptor::decode(0x03001386)), "3pwmgen.00.phase-C-inverted");
    EXPECT_EQ(function_of(PinDescriptor::decode(0x03011308)), "3pwmgen.01.fault");
    EXPECT_EQ(function_of(PinDescriptor::decode(0x03007701)), "module-0x77.00");
    EXPECT_EQ(function_of(PinDescriptor::decode(0x03000000)), "");
}

TEST(Registers, Control_of_encoders_has_its_bits_where_the_register_map_says) {
    EXPECT_EQ(encoder::index_polarity, 0x0008U);
    EXPECT_EQ(encoder::latch_on_index, 0x0010U);
    EXPECT_EQ(encoder::just_once, 0x0040U);
    EXPECT_EQ(encoder::mask_polarity, 0x0100U);
    EXPECT_EQ(encoder::use_mask, 0x0200U);
    EXPECT_EQ(encoder::filter_15, 0x0800U);
    EXPECT_EQ(encoder::probe_polarity, 0x1000U);
    EXPECT_EQ(encoder::latch_on_probe, 0x2000U);
}

TEST(Formulas, Give_the_values_seen_on_the_wire) {
    EXPECT_EQ(step_rate(1000.0, low), 0xa7c5);
    EXPECT_NEAR(steps_per_s(1, low), 0.0233, 0.0001);
    EXPECT_EQ(watchdog_timeout(20'000'000.0, low), 0x1e847fU);
    EXPECT_DOUBLE_EQ(watchdog_ns(0x1e847f, low), 20'000'000.0);
    EXPECT_EQ(timestamp_divider(2e6, low), 0x30U);
    EXPECT_DOUBLE_EQ(timestamp_hz(0x30, low), 2e6);
    EXPECT_EQ(encoder_filter(25e6, low), 2U);
    const PwmRate pwm = pwm_rate(20'000.0, high);
    EXPECT_EQ(pwm.rate, 0x68dbU);
    EXPECT_EQ(pwm.bits, 12U);
    EXPECT_EQ(pdm_rate(20'000.0, high), 6U);
    EXPECT_EQ(pwm_value(-0.5, 12) & 0xffff0000U, 0x87ff0000U);
    EXPECT_EQ(ssr_rate(1e6, low), 48U);
    const DpllRate dpll = dpll_rate(1000.0, 42, low);
    EXPECT_EQ(dpll.prescale, 24U);
    EXPECT_EQ(dpll.base, 0x3eea209aU);
    EXPECT_EQ(dpll_timer(100.0, 1000.0), 0xe667);
    EXPECT_NEAR(dpll_phase_us(0x00100000, 1000.0), 0.244, 0.001);
}

TEST(Formulas, Clip_what_a_register_cannot_have) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const double infinity = std::numeric_limits<double>::infinity();
    EXPECT_EQ(step_rate(1e12, low), 0x7fffffff);
    EXPECT_EQ(step_rate(-infinity, low), -0x7fffffff);
    EXPECT_EQ(step_rate(nan, low), 0);
    EXPECT_EQ(step_time(1e9, low), 0x3fffU);
    EXPECT_EQ(step_time(-5.0, low), 0U);
    EXPECT_EQ(step_time(nan, low), 0U);
    EXPECT_EQ(watchdog_timeout(1e12, low), 0x7fffffffU);
    EXPECT_EQ(watchdog_timeout(0.0, low), 0U);
    EXPECT_EQ(pwm_value(7.0, 12), 4095U << 16);
    EXPECT_EQ(dpll_rate(1000.0, 0, low).prescale, 255U);
    EXPECT_EQ(dpll_timer(2000.0, 1000.0), 0);
    EXPECT_EQ(dpll_timer(100.0, 0.0), 0);
    const PwmRate fast = pwm_rate(390'000.0, high);
    EXPECT_EQ(fast.bits, 9U);
    EXPECT_EQ(fast.rate, 65431U);
    EXPECT_EQ(pwm_rate(1e9, high).rate, 65535U);
}

TEST(Boards, Names_are_compared_as_far_as_cards_have_them) {
    EXPECT_EQ(board_of("7I92H")->name, "7i92");
    EXPECT_EQ(board_of("7I76E-16")->name, "7i76e");
    EXPECT_EQ(board_of("7I96S")->name, "7i96s");
    EXPECT_EQ(board_of("7I96")->name, "7i96");
    EXPECT_EQ(board_of("7I96X"), nullptr);
    EXPECT_EQ(board_of(""), nullptr);
}

TEST(SmartSerial, Records_come_back_as_they_went) {
    smart_serial::Record record;
    record.bits = 8;
    record.type = smart_serial::RecordType::unsigned_number;
    record.direction = smart_serial::Direction::out;
    record.max = 100.0F;
    record.address = 0x0123;
    record.unit = "rpm";
    record.name = "SpinOut";
    const auto bytes = encode(record);
    EXPECT_EQ(hex(std::span(bytes).first(14)), "A0 08 02 80 00 00 00 00 00 00 C8 42 23 01");
    EXPECT_EQ(smart_serial::decode_record(bytes), record);
    for (std::size_t size = 0; size < bytes.size(); ++size) {
        EXPECT_FALSE(smart_serial::decode_record(std::span(bytes).first(size)));
    }
    const smart_serial::ModeRecord mode{1, 1, "TwoEncoders"};
    EXPECT_EQ(smart_serial::decode_mode(encode(mode)), mode);
    EXPECT_FALSE(smart_serial::decode_mode(bytes));
    EXPECT_FALSE(smart_serial::decode_record(encode(mode)));
}

TEST(SmartSerial, Outputs_of_a_7i76_are_packed_from_the_lowest_bit) {
    std::uint32_t words[] = {0, 0};
    smart_serial::put_bits(words, 0, 16, 1U << 0 | 1U << 3 | 1U << 15);
    smart_serial::put_bits(words, 16, 8, 0x7f);  // half of the speed
    smart_serial::put_bits(words, 24, 1, 1);
    EXPECT_EQ(words[0], 0x017f8009U);
    EXPECT_EQ(smart_serial::take_bits(words, 16, 8), 0x7fU);
    smart_serial::put_bits(words, 28, 10, 0x3ff);
    EXPECT_EQ(smart_serial::take_bits(words, 28, 10), 0x3ffU);
    EXPECT_EQ(words[1], 0x3fU);
    smart_serial::put_bits(words, 60, 10, 0x3ff);
    EXPECT_EQ(smart_serial::take_bits(words, 60, 10), 0xfU);
}

TEST(Formulas, Three_phases_have_ten_bits_each_around_the_middle) {
    EXPECT_EQ(three_phase_value(0.0, 0.0, 0.0), 512U << 20 | 512U << 10 | 512U);
    EXPECT_EQ(three_phase_value(1.0, -1.0, 5.0), 1023U << 20 | 1U << 10 | 1023U);
    EXPECT_EQ(three_phase_value(std::nan(""), 0.0, 0.0) & 0x3ffU, 512U);
    EXPECT_DOUBLE_EQ(three_phase_duty(three_phase_value(1.0, -1.0, 0.0), 1), -1.0);
    EXPECT_EQ(three_phase_rate(20'000.0, low), 26843U);
    EXPECT_EQ(three_phase_rate(1e6, low), 65535U);
    // 2 x 65536 / (100 MHz x 26843) is 48.83 ns
    EXPECT_EQ(three_phase_dead_time(5000.0, 26843, low), 102U);
    EXPECT_EQ(three_phase_dead_time(1e6, 26843, low), 511U);
    EXPECT_EQ(three_phase_dead_time(-1.0, 0, low), 0U);
    EXPECT_EQ(three_phase_sample(0.5), 511U);
    EXPECT_EQ(three_phase_sample(2.0), 1023U);
}

TEST(Formulas, Skew_of_multiplexed_encoders_is_rounded_to_clocks) {
    EXPECT_EQ(encoder_skew(0.0, low), 0U);
    EXPECT_EQ(encoder_skew(44.0, low), 4U);
    EXPECT_EQ(encoder_skew(45.0, low), 5U);
    EXPECT_EQ(encoder_skew(1000.0, low), 15U);
}

}  // namespace
}  // namespace hal::mesa
