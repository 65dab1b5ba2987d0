// SPDX-License-Identifier: MIT
// 7I92: firmware 7i76x2 (pins of PIN_7I76x2_34). 7I76E: PIN_7I76E_51; its free pins have the modules
// of other firmware. 7I96S: the modules of 7i96s_d; which pins of its second and third port they have
// is not published, so that part is ours, and so are the pins of the 7I95.
#include "card_model.hpp"

#include <algorithm>
#include <array>

#include "mesa/hostmot2/module_kinds.hpp"
#include "mesa/hostmot2/pin.hpp"

namespace hal::mesa {

namespace {

constexpr ModuleDescriptor ports_module(std::uint8_t ports) {
    return module_descriptor(Tag::ioport, 0x1000, {.instances = ports});
}
constexpr ModuleDescriptor stepgen_module(std::uint8_t count) {
    return module_descriptor(Tag::stepgen, 0x2000, {.instances = count, .version = 2});
}
constexpr ModuleDescriptor encoder_module(std::uint8_t count) {
    return module_descriptor(Tag::encoder, 0x3000, {.instances = count, .version = 2});
}
constexpr ModuleDescriptor muxed_encoder_module(std::uint8_t count) {
    return module_descriptor(Tag::muxed_encoder, 0x3500, {.instances = count, .version = 4});
}
constexpr ModuleDescriptor three_phase_module(std::uint8_t count) {
    return module_descriptor(Tag::three_phase_pwm, 0x4500,
                             {.instances = count, .clock = ClockTag::high});
}
constexpr ModuleDescriptor packet_uart_module(Tag tag, std::uint16_t base) {
    return module_descriptor(tag, base, {.version = 2});
}
constexpr auto packet_transmit_module = packet_uart_module(Tag::packet_uart_transmit, 0x6100);
constexpr auto packet_receive_module = packet_uart_module(Tag::packet_uart_receive, 0x6500);
constexpr auto pwm_module = module_descriptor(Tag::pwm, 0x4100, {.clock = ClockTag::high});
constexpr auto watchdog_module = module_descriptor(Tag::watchdog, 0x0c00);
constexpr auto inmux_module = module_descriptor(Tag::inmux, 0x8000);
constexpr auto serial_module = module_descriptor(Tag::smart_serial, 0x5b00);
constexpr auto dpll_module = module_descriptor(Tag::dpll, 0x7000);
constexpr auto led_module = module_descriptor(Tag::led, 0x0200);
constexpr auto ssr_module = module_descriptor(Tag::ssr, 0x7d00);
constexpr auto inm_module = module_descriptor(Tag::inm, 0x8500);
constexpr auto outm_module = module_descriptor(Tag::outm, 0xb000);
constexpr ModuleDescriptor mux_select_module{.tag = Tag::mux_select, .instances = 1};

constexpr ModuleDescriptor modules_7i92[] = {watchdog_module, ports_module(2),    encoder_module(2),
                                             serial_module,   stepgen_module(10), led_module};
constexpr ModuleDescriptor modules_7i76e[] = {
    dpll_module,           watchdog_module,   ports_module(3),       encoder_module(1),
    serial_module,         stepgen_module(5), three_phase_module(2), packet_transmit_module,
    packet_receive_module, led_module};
constexpr ModuleDescriptor modules_7i95[] = {
    dpll_module,   watchdog_module,   ports_module(2),         inmux_module,      ssr_module,
    serial_module, stepgen_module(6), muxed_encoder_module(6), mux_select_module, led_module};
constexpr ModuleDescriptor modules_7i96s[] = {
    dpll_module,   watchdog_module,   ports_module(3), inm_module, ssr_module,       outm_module,
    serial_module, stepgen_module(5), pwm_module,      led_module, encoder_module(1)};

constexpr std::uint32_t pin(Tag module, unsigned unit, unsigned number, bool is_output) {
    return PinDescriptor{.number = static_cast<std::uint8_t>(number),
                         .is_output = is_output,
                         .module = module,
                         .unit = static_cast<std::uint8_t>(unit)}
        .encode();
}
constexpr std::uint32_t free_pin = PinDescriptor{}.encode();

/// Direction and step of `count` step generators from pin `at`.
constexpr void put_step_generators(std::span<std::uint32_t> pins, std::size_t at, unsigned first,
                                   unsigned count, bool step_first) {
    for (unsigned n = 0; n < count; ++n) {
        using namespace pin_number::stepgen;
        const std::uint32_t step_pin = pin(Tag::stepgen, first + n, step, true);
        const std::uint32_t direction_pin = pin(Tag::stepgen, first + n, direction, true);
        pins[at + 2 * n] = step_first ? step_pin : direction_pin;
        pins[at + 2 * n + 1] = step_first ? direction_pin : step_pin;
    }
}

/// Sending and receiving pin of two channels, then index, B and A of an encoder: the second half of
/// a connector for a 7I76.
constexpr void put_7i76_rest(std::span<std::uint32_t> pins, std::size_t at, unsigned channel,
                             unsigned counter) {
    for (unsigned n = 0; n < 2; ++n) {
        pins[at + 2 * n] =
            pin(Tag::smart_serial, 0, pin_number::smart_serial::first_transmit + channel + n, true);
        pins[at + 2 * n + 1] =
            pin(Tag::smart_serial, 0, pin_number::smart_serial::first_receive + channel + n, false);
    }
    pins[at + 4] = pin(Tag::encoder, counter, pin_number::encoder::index, false);
    pins[at + 5] = pin(Tag::encoder, counter, pin_number::encoder::b, false);
    pins[at + 6] = pin(Tag::encoder, counter, pin_number::encoder::a, false);
}

/// Index and probe of `count` step generators from pin `at`, of firmware that has them.
constexpr void put_latch_inputs(std::span<std::uint32_t> pins, std::size_t at, unsigned count) {
    for (unsigned n = 0; n < count; ++n) {
        pins[at + 2 * n] = pin(Tag::stepgen, n, pin_number::stepgen::index, false);
        pins[at + 2 * n + 1] = pin(Tag::stepgen, n, pin_number::stepgen::probe, false);
    }
}

constexpr void put_three_phases(std::span<std::uint32_t> pins, std::size_t at, unsigned unit) {
    for (unsigned number = 1; number < pin_number::three_phase_pwm::fault; ++number) {
        pins[at + number - 1] = pin(Tag::three_phase_pwm, unit, number, true);
    }
    pins[at + 7] = pin(Tag::three_phase_pwm, unit, pin_number::three_phase_pwm::fault, false);
}

constexpr auto pins_7i92 = [] {
    std::array<std::uint32_t, 34> pins{};
    for (unsigned connector = 0; connector < 2; ++connector) {
        put_step_generators(pins, connector * 17, connector * 5, 5, false);
        put_7i76_rest(pins, connector * 17 + 10, connector * 2, connector);
    }
    return pins;
}();

constexpr auto pins_7i76e = [] {
    std::array<std::uint32_t, 51> pins{};
    pins.fill(free_pin);
    put_step_generators(pins, 0, 0, 5, false);
    put_7i76_rest(pins, 10, 0, 0);
    put_latch_inputs(pins, 17, 5);
    pins[27] = pin(Tag::packet_uart_transmit, 0, 1, true);
    pins[28] = pin(Tag::packet_uart_transmit, 0, 3, true);
    pins[29] = pin(Tag::packet_uart_receive, 0, 1, false);
    pins[33] = pin(Tag::encoder, 0, pin_number::encoder::probe, false);
    put_three_phases(pins, 35, 0);
    put_three_phases(pins, 43, 1);
    return pins;
}();

constexpr auto pins_7i95 = [] {
    std::array<std::uint32_t, 58> pins{};
    pins.fill(free_pin);
    put_step_generators(pins, 0, 0, 6, true);
    for (unsigned pair = 0; pair < 3; ++pair) {
        using namespace pin_number::encoder;
        pins[12 + 3 * pair] = pin(Tag::muxed_encoder, pair, a, false);
        pins[13 + 3 * pair] = pin(Tag::muxed_encoder, pair, b, false);
        pins[14 + 3 * pair] = pin(Tag::muxed_encoder, pair, index, false);
    }
    pins[21] = pin(Tag::mux_select, 0, 1, true);
    for (unsigned n = 0; n < 5; ++n) {
        pins[22 + n] = pin(Tag::inmux, 0, pin_number::inmux::first_address + n, true);
    }
    pins[27] = pin(Tag::inmux, 0, pin_number::inmux::data, false);
    for (unsigned n = 0; n < 6; ++n) {
        pins[28 + n] = pin(Tag::ssr, 0, n + 1, true);
    }
    pins[34] = pin(Tag::ssr, 0, pin_number::ssr::reference, true);
    for (unsigned channel = 0; channel < 2; ++channel) {
        using namespace pin_number::smart_serial;
        pins[35 + 3 * channel] = pin(Tag::smart_serial, 0, first_receive + channel, false);
        pins[36 + 3 * channel] = pin(Tag::smart_serial, 0, first_transmit + channel, true);
        pins[37 + 3 * channel] = pin(Tag::smart_serial, 0, first_enable + channel, true);
    }
    put_latch_inputs(pins, 41, 6);
    pins[53] = pin(Tag::muxed_encoder, PinDescriptor::all_units, pin_number::encoder::probe, false);
    return pins;
}();

constexpr auto pins_7i96s = [] {
    std::array<std::uint32_t, 51> pins{};
    pins.fill(free_pin);
    for (unsigned n = 0; n < 11; ++n) {
        pins[n] = pin(Tag::inm, 0, n + 1, false);
    }
    for (unsigned n = 0; n < 4; ++n) {
        pins[11 + n] = pin(Tag::ssr, 0, n + 1, true);
    }
    pins[15] = pin(Tag::outm, 0, 5, true);
    pins[16] = pin(Tag::outm, 0, 6, true);
    put_step_generators(pins, 17, 0, 5, true);
    pins[27] = pin(Tag::encoder, 0, pin_number::encoder::a, false);
    pins[28] = pin(Tag::encoder, 0, pin_number::encoder::b, false);
    pins[29] = pin(Tag::encoder, 0, pin_number::encoder::index, false);
    pins[30] = pin(Tag::smart_serial, 0, pin_number::smart_serial::first_receive, false);
    pins[31] = pin(Tag::smart_serial, 0, pin_number::smart_serial::first_transmit, true);
    pins[32] = pin(Tag::smart_serial, 0, pin_number::smart_serial::first_enable, true);
    pins[34] = pin(Tag::pwm, 0, pin_number::pwm::out, true);
    pins[35] = pin(Tag::pwm, 0, pin_number::pwm::direction, true);
    pins[36] = pin(Tag::pwm, 0, pin_number::pwm::not_enable, true);
    return pins;
}();

constexpr CardModel models[] = {
    {"7i92", "7I92", "MESA7I92", 2, 2, 17, modules_7i92, pins_7i92, 0x1},
    {"7i76e", "7I76E-16", "MESA7I76", 2, 3, 17, modules_7i76e, pins_7i76e, 0x1},
    {"7i95", "7I95", "MESA7I95", 2, 2, 29, modules_7i95, pins_7i95, 0x0},
    {"7i96s", "7I96S", "MESA7I96", 3, 3, 17, modules_7i96s, pins_7i96s, 0x0},
};

}  // namespace

std::span<const CardModel> card_models() noexcept { return models; }

const CardModel* find_card_model(std::string_view type) noexcept {
    const auto found = std::ranges::find(models, type, &CardModel::type);
    return found == std::end(models) ? nullptr : found;
}

std::vector<std::string> card_types() {
    std::vector<std::string> types;
    for (const CardModel& model : models) {
        types.emplace_back(model.type);
    }
    return types;
}

}  // namespace hal::mesa
