// SPDX-License-Identifier: MIT
// Modules of a HostMot2 firmware and their descriptors.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "mesa/hostmot2/idrom.hpp"

namespace hal::mesa {

/// Kinds of modules, as in descriptors of modules and pins.
enum class Tag : std::uint8_t {
    none = 0x00,
    watchdog = 0x02,
    ioport = 0x03,
    encoder = 0x04,
    stepgen = 0x05,
    pwm = 0x06,
    uart_transmit = 0x09,
    uart_receive = 0x0a,
    muxed_encoder = 0x0c,
    mux_select = 0x0d,  ///< pins without registers
    three_phase_pwm = 0x13,
    dpll = 0x1a,
    packet_uart_transmit = 0x1b,
    packet_uart_receive = 0x1c,
    inmux = 0x1e,
    inm = 0x23,
    outm = 0x2d,
    led = 0x80,
    smart_serial = 0xc1,
    ssr = 0xc3,
    wide_smart_serial = 0xc6,  ///< 224 bits per channel
};

enum class ClockTag : std::uint8_t { low = 1, high = 2 };

inline constexpr std::size_t max_modules = 48;

/// The descriptor of a module: all instances of one kind.
struct ModuleDescriptor {
    static constexpr std::size_t size = 12;

    Tag tag = Tag::none;  ///< none ends the table
    std::uint8_t version = 0;
    ClockTag clock = ClockTag::low;
    std::uint8_t instances = 0;
    std::uint16_t base = 0;
    std::uint8_t registers = 0;
    std::uint8_t strides = 0;  ///< bits 0..3 choose the register stride, 4..7 the instance stride
    std::uint32_t per_instance = 0;  ///< bit r: each instance has its own register r

    std::array<std::uint8_t, size> encode() const noexcept;
    static std::optional<ModuleDescriptor> decode(std::span<const std::uint8_t> bytes) noexcept;

    friend bool operator==(const ModuleDescriptor&, const ModuleDescriptor&) = default;
};

/// The addresses of a module. Addresses are always those of the descriptor, because firmware files
/// of one card differ in them.
struct ModuleAddresses {
    std::uint16_t base = 0;
    std::uint16_t register_stride = 0;
    std::uint16_t instance_stride = 0;

    ModuleAddresses() = default;
    ModuleAddresses(const ModuleDescriptor& module, const Idrom& idrom) noexcept;
    /// Returns the address of a register of an instance. [any]
    std::uint16_t at(unsigned reg, unsigned instance = 0) const noexcept {
        return static_cast<std::uint16_t>(base + reg * register_stride +
                                          instance * instance_stride);
    }
};

/// What a driver can work with: of a known module all versions of the list, with these registers.
struct ModuleKind {
    Tag tag;
    std::string_view name;  ///< "stepgen", as in the config string of a driver
    std::span<const std::uint8_t> versions;  ///< empty: any
    std::uint8_t registers;
    std::uint16_t instance_stride;
    std::uint32_t per_instance;
    bool is_checked = true;  ///< whether a descriptor has to have these three
};
/// Returns nothing for an unknown module. [any]
const ModuleKind* kind_of(Tag tag) noexcept;
/// Returns the name of a kind of module, also of one that no driver here can work with; "?" if it is
/// unknown. [any]
std::string_view name_of(Tag tag) noexcept;

/// What a descriptor does not have in common with its kind.
enum class ModuleFault : std::uint8_t {
    none,
    version,
    registers,
    instance_stride,
    per_instance,
    outside,  ///< a register is outside the 64 KiB
};
/// Compares a descriptor with its kind. [any]
ModuleFault fault_of(const ModuleDescriptor& module, const ModuleKind& kind,
                     const Idrom& idrom) noexcept;

/// Returns the frequency of the clock of a module. [any]
inline std::uint32_t clock_hz(const ModuleDescriptor& module, const Idrom& idrom) noexcept {
    return module.clock == ClockTag::high ? idrom.clock_high_hz : idrom.clock_low_hz;
}

}  // namespace hal::mesa
