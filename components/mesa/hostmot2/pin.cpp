// SPDX-License-Identifier: MIT
#include "pin.hpp"

#include <cstdio>
#include <span>

namespace hal::mesa {

namespace {

/// The pins of one kind of module in one direction: `count` numbers from `first`.
struct Role {
    Tag tag;
    bool is_output;
    std::uint8_t first;
    std::uint8_t count;
    const char* name;  ///< with a conversion for the number from `counts_from`
    unsigned counts_from = 0;
};

constexpr Role roles[] = {
    {Tag::stepgen, true, 1, 1, "step"},
    {Tag::stepgen, true, 2, 1, "direction"},
    {Tag::stepgen, true, 3, 6, "table-%u", 3},
    {Tag::stepgen, false, 1, 1, "step"},  // of older firmware, whose outputs are not marked
    {Tag::stepgen, false, 2, 1, "direction"},
    {Tag::stepgen, false, 9, 1, "index"},
    {Tag::stepgen, false, 10, 1, "probe"},
    {Tag::encoder, false, 1, 1, "phase-A"},
    {Tag::encoder, false, 2, 1, "phase-B"},
    {Tag::encoder, false, 3, 1, "index"},
    {Tag::encoder, false, 4, 1, "index-mask"},
    {Tag::encoder, false, 5, 1, "probe"},
    {Tag::encoder, false, 6, 1, "shared-index"},
    {Tag::muxed_encoder, false, 1, 1, "phase-A"},
    {Tag::muxed_encoder, false, 2, 1, "phase-B"},
    {Tag::muxed_encoder, false, 3, 1, "index"},
    {Tag::muxed_encoder, false, 4, 1, "index-mask"},
    {Tag::muxed_encoder, false, 5, 1, "probe"},
    {Tag::muxed_encoder, false, 6, 1, "shared-index"},
    {Tag::mux_select, true, 1, 2, "sel%u"},
    {Tag::pwm, true, 1, 1, "out0"},
    {Tag::pwm, true, 2, 1, "out1"},
    {Tag::pwm, true, 3, 1, "enable"},
    {Tag::three_phase_pwm, true, 1, 1, "phase-A"},
    {Tag::three_phase_pwm, true, 2, 1, "phase-B"},
    {Tag::three_phase_pwm, true, 3, 1, "phase-C"},
    {Tag::three_phase_pwm, true, 4, 1, "phase-A-inverted"},
    {Tag::three_phase_pwm, true, 5, 1, "phase-B-inverted"},
    {Tag::three_phase_pwm, true, 6, 1, "phase-C-inverted"},
    {Tag::three_phase_pwm, true, 7, 1, "enable"},
    {Tag::three_phase_pwm, false, 8, 1, "fault"},
    {Tag::uart_transmit, true, 1, 1, "tx"},
    {Tag::uart_transmit, true, 2, 1, "txen"},
    {Tag::uart_receive, false, 1, 1, "rx"},
    {Tag::smart_serial, true, 1, 8, "tx%u"},
    {Tag::smart_serial, true, 11, 8, "txen%u"},
    {Tag::smart_serial, true, 21, 8, "not-txen%u"},
    {Tag::smart_serial, false, 1, 8, "rx%u"},
    {Tag::inm, false, 1, 32, "in-%02u"},
    {Tag::inmux, true, 1, 5, "address-%u"},
    {Tag::inmux, false, 1, 1, "data"},
    {Tag::ssr, true, 1, 31, "out-%02u"},
    {Tag::ssr, true, 32, 1, "reference"},
    {Tag::outm, true, 1, 32, "out-%02u"},
    {Tag::dpll, false, 1, 1, "sync-in"},
    {Tag::dpll, true, 2, 1, "reference-out"},
    {Tag::dpll, true, 3, 4, "timer-%u", 1},
    {Tag::packet_uart_transmit, true, 1, 1, "tx"},
    {Tag::packet_uart_transmit, true, 2, 1, "not-txen"},
    {Tag::packet_uart_transmit, true, 3, 1, "txen"},
    {Tag::packet_uart_receive, false, 1, 1, "rx"},
};

bool has(const Role& role, Tag tag, const PinDescriptor& pin) {
    return role.tag == tag && role.is_output == pin.is_output && pin.number >= role.first &&
           pin.number < role.first + role.count;
}

}  // namespace

std::string role_of(const PinDescriptor& pin) {
    const Tag tag = pin.module == Tag::wide_smart_serial ? Tag::smart_serial : pin.module;
    for (const Role& role : roles) {
        if (!has(role, tag, pin)) continue;
        char text[24];
        std::snprintf(text, sizeof text, role.name, pin.number - role.first + role.counts_from);
        return text;
    }
    return {};
}

std::string function_of(const PinDescriptor& pin) {
    if (pin.module == Tag::none) return {};
    std::string text(name_of(pin.module));
    if (text == "?") {
        char number[24];
        std::snprintf(number, sizeof number, "module-0x%02X", static_cast<unsigned>(pin.module));
        text = number;
    }
    if (pin.module == Tag::mux_select) {
        text = "encoder";  // as in LinuxCNC
    }
    if (pin.unit != PinDescriptor::all_units) {
        char unit[8];
        std::snprintf(unit, sizeof unit, ".%02u", pin.unit);
        text += unit;
    }
    const std::string role = role_of(pin);
    return role.empty() ? text : text + "." + role;
}

}  // namespace hal::mesa
