// SPDX-License-Identifier: MIT
#include "idrom.hpp"

#include <algorithm>

#include "mesa/hostmot2/module.hpp"

namespace hal::mesa {

namespace {

constexpr std::size_t board_at = 0x0c;

/// Calls `visit` with each 32-bit field of the IDROM and its offset.
template <class Rom, class Visit>
void visit_fields(Rom& rom, Visit visit) noexcept {
    visit(0x00, rom.type);
    visit(0x04, rom.modules);
    visit(0x08, rom.pins);
    visit(0x14, rom.fpga_size);
    visit(0x18, rom.fpga_pins);
    visit(0x1c, rom.ports);
    visit(0x20, rom.width);
    visit(0x24, rom.port_width);
    visit(0x28, rom.clock_low_hz);
    visit(0x2c, rom.clock_high_hz);
    visit(0x30, rom.instance_strides[0]);
    visit(0x34, rom.instance_strides[1]);
    visit(0x38, rom.register_strides[0]);
    visit(0x3c, rom.register_strides[1]);
}

constexpr std::uint64_t register_space = 0x10000;

}  // namespace

std::array<std::uint8_t, Idrom::size> Idrom::encode() const noexcept {
    std::array<std::uint8_t, size> bytes{};
    visit_fields(*this, [&](std::size_t offset, std::uint32_t value) {
        store(bytes.data() + offset, value);
    });
    std::copy(board.begin(), board.end(), bytes.begin() + board_at);
    return bytes;
}

std::optional<Idrom> Idrom::decode(std::span<const std::uint8_t> bytes) noexcept {
    if (bytes.size() < size) return {};
    Idrom rom;
    visit_fields(rom, [&](std::size_t offset, std::uint32_t& value) {
        value = load<std::uint32_t>(bytes.data() + offset);
    });
    std::copy_n(bytes.begin() + board_at, rom.board.size(), rom.board.begin());
    return rom;
}

IdromFault fault_of(const Idrom& idrom, std::uint16_t address) noexcept {
    if (idrom.type != 2 && idrom.type != 3) return IdromFault::type;
    const std::uint64_t pins = std::uint64_t{idrom.ports} * idrom.port_width;
    if (pins != idrom.width) return IdromFault::width;
    if (pins == 0) return IdromFault::no_pins;
    if (pins > max_pins) return IdromFault::many_pins;
    if (std::min(idrom.clock_low_hz, idrom.clock_high_hz) < min_clock_hz) return IdromFault::clock;
    const std::uint64_t end_of_pins = std::uint64_t{address} + idrom.pins + pins * 4;
    const std::uint64_t end_of_modules =
        std::uint64_t{address} + idrom.modules + max_modules * ModuleDescriptor::size;
    if (std::max(end_of_pins, end_of_modules) > register_space) return IdromFault::descriptors;
    return IdromFault::none;
}

}  // namespace hal::mesa
