// SPDX-License-Identifier: MIT
// The modules of HostMot2 that a driver here can work with, and their descriptors.
#pragma once

#include <algorithm>
#include <iterator>

#include "mesa/hostmot2/module.hpp"

namespace hal::mesa {

namespace module_versions {
inline constexpr std::uint8_t first[] = {0};
inline constexpr std::uint8_t encoder[] = {2, 3, 0x83};
inline constexpr std::uint8_t muxed_encoder[] = {2, 3, 4, 0x84};
inline constexpr std::uint8_t stepgen[] = {0, 1, 2, 0x42, 0xc2};
inline constexpr std::uint8_t pwm[] = {0, 1};
inline constexpr std::uint8_t packet_uart[] = {0, 1, 2, 3};
}  // namespace module_versions

/// As hostmot2 of LinuxCNC accepts them: it does not check those that are not checked here.
inline constexpr ModuleKind module_kinds[] = {
    {Tag::watchdog, "watchdog", module_versions::first, 3, 4, 0},
    {Tag::ioport, "ioport", module_versions::first, 5, 4, 0x1f},
    {Tag::encoder, "encoder", module_versions::encoder, 5, 4, 0x3},
    {Tag::stepgen, "stepgen", module_versions::stepgen, 10, 4, 0x1ff},
    {Tag::pwm, "pwmgen", module_versions::pwm, 5, 4, 0x3},
    {Tag::muxed_encoder, "muxed encoder", module_versions::muxed_encoder, 5, 4, 0x3},
    {Tag::three_phase_pwm, "3pwmgen", module_versions::first, 4, 4, 0x3},
    {Tag::uart_transmit, "UART transmit", module_versions::first, 4, 0x10, 0xf},
    {Tag::uart_receive, "UART receive", module_versions::first, 4, 0x10, 0xf},
    {Tag::packet_uart_transmit, "packet UART transmit", module_versions::packet_uart, 4, 4, 0xf},
    {Tag::packet_uart_receive, "packet UART receive", module_versions::packet_uart, 4, 4, 0xf},
    {Tag::dpll, "dpll", module_versions::first, 7, 4, 0},
    {Tag::inmux, "inmux", {}, 5, 4, 0x1f, false},
    {Tag::inm, "inm", {}, 5, 4, 0x1f, false},
    {Tag::outm, "outm", {}, 1, 4, 0x1, false},
    {Tag::led, "led", module_versions::first, 1, 4, 0},
    {Tag::smart_serial, "sserial", module_versions::first, 6, 0x40, 0x3c},
    {Tag::wide_smart_serial, "sserial", module_versions::first, 10, 0x40, 0x3fc},
    {Tag::ssr, "ssr", {}, 2, 4, 0x3, false},
};

/// What differs between the firmware files of cards.
struct ModuleChoice {
    std::uint8_t instances = 1;
    std::uint8_t version = 0;
    ClockTag clock = ClockTag::low;
};

/// Returns a descriptor of a module of the table, for an IDROM with the usual strides.
constexpr ModuleDescriptor module_descriptor(Tag tag, std::uint16_t base,
                                             const ModuleChoice& choice = {}) {
    const ModuleKind& kind = *std::ranges::find(module_kinds, tag, &ModuleKind::tag);
    ModuleDescriptor module;
    module.tag = tag;
    module.version = choice.version;
    module.clock = choice.clock;
    module.instances = choice.instances;
    module.base = base;
    module.registers = kind.registers;
    module.strides = kind.instance_stride == Idrom{}.instance_strides[0] ? 0x00 : 0x10;
    module.per_instance = kind.per_instance;
    return module;
}

}  // namespace hal::mesa
