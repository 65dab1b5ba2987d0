// SPDX-License-Identifier: MIT
// 7I92: firmware 7i76x2 (pins of PIN_7I76x2_34). 7I76E: PIN_7I76E_51. 7I96S: the modules of
// 7i96s_d; which pins of its second and third port they have is not published, so that part is
// ours.
#include "card_model.hpp"

#include <algorithm>
#include <array>

#include "mesa/hostmot2/pin.hpp"

namespace hal::mesa {

namespace {

constexpr ModuleDescriptor watchdog_module{Tag::watchdog, 0, ClockTag::low, 1, 0x0c00, 3, 0, 0};
constexpr ModuleDescriptor ports_module(std::uint8_t ports) {
    return {Tag::ioport, 0, ClockTag::low, ports, 0x1000, 5, 0, 0x1f};
}
constexpr ModuleDescriptor stepgen_module(std::uint8_t count) {
    return {Tag::stepgen, 2, ClockTag::low, count, 0x2000, 10, 0, 0x1ff};
}
constexpr ModuleDescriptor encoder_module(std::uint8_t count) {
    return {Tag::encoder, 2, ClockTag::low, count, 0x3000, 5, 0, 0x3};
}
constexpr ModuleDescriptor serial_module{
    Tag::smart_serial, 0, ClockTag::low, 1, 0x5b00, 6, 0x10, 0x3c};
constexpr ModuleDescriptor dpll_module{Tag::dpll, 0, ClockTag::low, 1, 0x7000, 7, 0, 0};
constexpr ModuleDescriptor led_module{Tag::led, 0, ClockTag::low, 1, 0x0200, 1, 0, 0};
constexpr ModuleDescriptor pwm_module{Tag::pwm, 0, ClockTag::high, 1, 0x4100, 5, 0, 0x3};
constexpr ModuleDescriptor ssr_module{Tag::ssr, 0, ClockTag::low, 1, 0x7d00, 2, 0, 0x3};
constexpr ModuleDescriptor inm_module{Tag::inm, 0, ClockTag::low, 1, 0x8500, 5, 0, 0x1f};
constexpr ModuleDescriptor outm_module{Tag::outm, 0, ClockTag::low, 1, 0xb000, 1, 0, 0x1};

constexpr ModuleDescriptor modules_7i92[] = {watchdog_module, ports_module(2),    encoder_module(2),
                                             serial_module,   stepgen_module(10), led_module};
constexpr ModuleDescriptor modules_7i76e[] = {dpll_module,       watchdog_module, ports_module(3),
                                              encoder_module(1), serial_module,   stepgen_module(5),
                                              led_module};
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
