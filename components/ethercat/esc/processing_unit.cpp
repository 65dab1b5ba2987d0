// SPDX-License-Identifier: MIT
#include "ethercat/esc/processing_unit.hpp"

#include <algorithm>
#include <array>
#include <cstring>

#include "ethercat/wire/byte_order.hpp"

namespace hal::ethercat::esc {

namespace {

constexpr std::uint16_t digital_outputs = 0x0f00;
constexpr std::uint16_t digital_outputs_end = 0x0f04;

enum class Addressing : std::uint8_t { position, station, broadcast, logical };
/// The last one reads where it is addressed, and writes at all other slaves.
enum class Access : std::uint8_t { read, write, read_and_write, read_or_write };

struct CommandRow {
    Command command;
    Addressing addressing;
    Access access;
    bool reads() const noexcept { return access != Access::write; }
    bool writes() const noexcept { return access != Access::read; }
};
constexpr CommandRow command_rows[] = {
    {Command::nop, Addressing::position, Access::read},  // not executed
    {Command::aprd, Addressing::position, Access::read},
    {Command::apwr, Addressing::position, Access::write},
    {Command::aprw, Addressing::position, Access::read_and_write},
    {Command::fprd, Addressing::station, Access::read},
    {Command::fpwr, Addressing::station, Access::write},
    {Command::fprw, Addressing::station, Access::read_and_write},
    {Command::brd, Addressing::broadcast, Access::read},
    {Command::bwr, Addressing::broadcast, Access::write},
    {Command::brw, Addressing::broadcast, Access::read_and_write},
    {Command::lrd, Addressing::logical, Access::read},
    {Command::lwr, Addressing::logical, Access::write},
    {Command::lrw, Addressing::logical, Access::read_and_write},
    {Command::armw, Addressing::position, Access::read_or_write},
    {Command::frmw, Addressing::station, Access::read_or_write},
};
constexpr bool in_order_of_their_numbers() {
    for (std::size_t n = 0; n < std::size(command_rows); ++n) {
        if (static_cast<std::size_t>(command_rows[n].command) != n) return false;
    }
    return true;
}
static_assert(in_order_of_their_numbers());

const CommandRow* row_of(Command command) noexcept {
    const auto number = static_cast<std::size_t>(command);
    const bool executed = command != Command::nop && number < std::size(command_rows);
    return executed ? &command_rows[number] : nullptr;
}

/// Returns whether the unit has a command.
bool supports(const UnitSettings& settings, const CommandRow& row) noexcept {
    if (row.access != Access::read_and_write) return true;
    return row.addressing == Addressing::logical ? settings.lrw : settings.read_write;
}

/// The part of an FMMU that a datagram covers, in bits.
struct Part {
    std::uint64_t in_frame = 0;
    std::uint64_t in_memory = 0;
    std::uint64_t bits = 0;
    Part(const Fmmus::Unit& u, const DatagramView& d) noexcept {
        const std::uint64_t frame_first = std::uint64_t{d.address} * 8;

        const std::uint64_t first = std::max(u.first_bit, frame_first);
        const std::uint64_t end =
            std::min(u.first_bit + u.bits, frame_first + std::uint64_t{d.length} * 8);
        if (first >= end) return;
        bits = end - first;
        in_frame = first - frame_first;
        in_memory = u.physical_bit + first - u.first_bit;
    }
    std::uint32_t address() const noexcept { return static_cast<std::uint32_t>(in_memory / 8); }
    std::size_t bytes() const noexcept {
        return static_cast<std::size_t>((in_memory + bits + 7) / 8 - in_memory / 8);
    }
};

bool bit(const std::uint8_t* from, std::uint64_t at) noexcept {
    return (from[at / 8] >> at % 8 & 1) != 0;
}
void set_bit(std::uint8_t* to, std::uint64_t at, bool value) noexcept {
    const auto mask = static_cast<std::uint8_t>(1U << at % 8);
    to[at / 8] = static_cast<std::uint8_t>(value ? to[at / 8] | mask : to[at / 8] & ~mask);
}

}  // namespace

ProcessingUnit::Effect ProcessingUnit::execute(const DatagramView& d) noexcept {
    effect_ = {};
    const CommandRow* row = row_of(d.command);
    if (row == nullptr) return effect_;
    const bool supported = supports(settings_, *row);
    if (row->addressing == Addressing::logical) {
        if (supported) {
            logical(d, row->reads(), row->writes());
        }
        return effect_;
    }
    if (row->addressing == Addressing::station) {
        const bool here =
            d.position() == memory_.station_address() || memory_.has_alias(d.position());
        if (row->access == Access::read_or_write) {
            physical(d, here, !here, false);
        } else if (here && supported) {
            physical(d, row->reads(), row->writes(), false);
        }
        return effect_;
    }
    // The address in the view is that of the frame when it was sent; slaves before this one counted
    // it up in the frame.
    const auto position = get<std::uint16_t>(d.header + 2);
    const bool broadcast = row->addressing == Addressing::broadcast;
    const bool here = broadcast || position == 0;
    if (row->access == Access::read_or_write) {
        physical(d, here, !here, false);
    } else if (here && supported) {
        physical(d, row->reads(), row->writes(), broadcast);
    }
    put(d.header + 2, static_cast<std::uint16_t>(position + 1));
    return effect_;
}

void ProcessingUnit::physical(const DatagramView& d, bool reads, bool writes,
                              bool broadcast) noexcept {
    const std::uint16_t address = d.register_address();
    const std::span<std::uint8_t> data{d.data, d.length};
    std::uint16_t wkc = d.wkc();
    if (d.length == 0) return;
    if (reads && (writes || broadcast)) {
        std::array<std::uint8_t, max_frame_bytes> mine;
        const std::span<std::uint8_t> old{mine.data(), data.size()};
        const bool accepted = memory_.read(address, old);
        if (writes && memory_.write(address, data, nullptr)) {
            wkc = static_cast<std::uint16_t>(wkc + 2);
        }
        if (accepted) {
            ++wkc;
            if (broadcast) {
                for (std::size_t i = 0; i < data.size(); ++i) {
                    data[i] |= old[i];
                }
            } else {
                std::copy(old.begin(), old.end(), data.begin());
            }
        }
        effect_.touched |= !broadcast;
    } else if (reads) {
        if (memory_.read(address, data)) {
            ++wkc;
        }
        effect_.touched = true;
    } else if (memory_.write(address, data, nullptr)) {
        ++wkc;
    }
    d.set_wkc(wkc);
}

void ProcessingUnit::logical(const DatagramView& d, bool reads, bool writes) noexcept {
    if (!fmmus_.hit(d.address, d.length)) return;
    std::array<std::uint8_t, max_frame_bytes> copy;
    const std::uint8_t* sent = d.data;
    if (reads && writes && fmmus_.overlap()) {
        std::memcpy(copy.data(), d.data, d.length);
        sent = copy.data();
    }
    bool did_read = false;
    bool did_write = false;
    if (reads) {
        for (const auto& unit : fmmus_) {
            if (unit.reads) {
                did_read |= read_logical(unit, d);
            }
        }
    }
    if (writes) {
        for (const auto& unit : fmmus_) {
            if (unit.writes) {
                did_write |= write_logical(unit, d, sent);
            }
        }
    }
    if (did_read || did_write) {
        const unsigned write_counts = d.command == Command::lrw ? 2 : 1;
        const unsigned counted = static_cast<unsigned>(did_read) + (did_write ? write_counts : 0U);
        d.set_wkc(static_cast<std::uint16_t>(d.wkc() + counted));
        effect_.process_data = true;
    }
}

bool ProcessingUnit::read_logical(const Fmmus::Unit& unit, const DatagramView& d) noexcept {
    const Part part(unit, d);
    if (part.bits == 0) return false;
    if (unit.bytes) {
        return memory_.read(part.address(), {d.data + part.in_frame / 8, part.bytes()});
    }
    std::array<std::uint8_t, max_frame_bytes> bytes;
    if (!memory_.read(part.address(), {bytes.data(), part.bytes()})) return false;
    const std::uint64_t shift = part.in_memory % 8;
    for (std::uint64_t i = 0; i < part.bits; ++i) {
        set_bit(d.data, part.in_frame + i, bit(bytes.data(), shift + i));
    }
    return true;
}

bool ProcessingUnit::write_logical(const Fmmus::Unit& unit, const DatagramView& d,
                                   const std::uint8_t* data) noexcept {
    const Part part(unit, d);
    if (part.bits == 0) return false;
    if (unit.bytes) {
        return memory_.write(part.address(), {data + part.in_frame / 8, part.bytes()}, nullptr);
    }
    std::array<std::uint8_t, max_frame_bytes> bytes, mask;
    std::fill_n(bytes.begin(), part.bytes(), std::uint8_t{0});
    std::fill_n(mask.begin(), part.bytes(), std::uint8_t{0});
    const std::uint64_t shift = part.in_memory % 8;
    for (std::uint64_t i = 0; i < part.bits; ++i) {
        set_bit(bytes.data(), shift + i, bit(data, part.in_frame + i));
        set_bit(mask.data(), shift + i, true);
    }
    const bool outputs =
        part.address() >= digital_outputs && part.address() + part.bytes() <= digital_outputs_end;
    return memory_.write(part.address(), {bytes.data(), part.bytes()},
                         settings_.bit_writes || outputs ? mask.data() : nullptr);
}

}  // namespace hal::ethercat::esc
