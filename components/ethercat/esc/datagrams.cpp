// SPDX-License-Identifier: MIT
// How a controller executes datagrams (ETG.1000.4, clause 5.4), with the rules of the working
// counter.
#include <algorithm>
#include <cstring>

#include "ethercat/esc/controller.hpp"
#include "ethercat/wire/byte_order.hpp"
#include "ethercat/wire/registers.hpp"

namespace hal::ethercat::esc {

namespace datagram_facts {
constexpr std::uint16_t first_memory = 0x0f00;  ///< from here on sync managers rule
constexpr std::uint16_t digital_outputs = 0x0f00;
constexpr std::uint16_t digital_outputs_end = 0x0f04;
}  // namespace datagram_facts

void Controller::datagram(const DatagramView& d) noexcept {
    const auto pass = [&](bool reads, bool writes) { physical(d, reads, writes, false); };
    // The address in the view is that of the frame when it was sent; slaves before this one counted
    // it up in the frame.
    const auto position = get<std::uint16_t>(d.header + 2);
    const auto addressed = [&] {
        return d.position() == get<std::uint16_t>(&memory_[registers::station_address]) ||
               ((memory_[registers::dl_alias_enable] & 1) != 0 &&
                d.position() == get<std::uint16_t>(&memory_[registers::station_alias]));
    };
    const auto step = [&] { put(d.header + 2, static_cast<std::uint16_t>(position + 1)); };
    switch (d.command) {
    case Command::aprd:
        if (position == 0) {
            pass(true, false);
        }
        return step();
    case Command::apwr:
        if (position == 0) {
            pass(false, true);
        }
        return step();
    case Command::aprw:
        if (position == 0 && settings_.read_write) {
            pass(true, true);
        }
        return step();
    case Command::fprd:
        if (addressed()) {
            pass(true, false);
        }
        return;
    case Command::fpwr:
        if (addressed()) {
            pass(false, true);
        }
        return;
    case Command::fprw:
        if (addressed() && settings_.read_write) {
            pass(true, true);
        }
        return;
    case Command::brd: physical(d, true, false, true); return step();
    case Command::bwr: physical(d, false, true, true); return step();
    case Command::brw:
        if (settings_.read_write) {
            physical(d, true, true, true);
        }
        return step();
    case Command::armw: pass(position == 0, position != 0); return step();
    case Command::frmw: {
        const bool here = addressed();
        return pass(here, !here);
    }
    case Command::lrd: return logical(d, true, false);
    case Command::lwr: return logical(d, false, true);
    case Command::lrw:
        if (settings_.lrw) {
            logical(d, true, true);
        }
        return;
    case Command::nop: break;
    }
}

void Controller::physical(const DatagramView& d, bool reads, bool writes, bool broadcast) noexcept {
    const std::uint16_t address = d.register_address();
    const std::span<std::uint8_t> data{d.data, d.length};
    std::uint16_t wkc = d.wkc();
    if (d.length == 0) return;
    if (reads && (writes || broadcast)) {
        std::array<std::uint8_t, largest_frame_bytes> mine;
        const std::span<std::uint8_t> old{mine.data(), data.size()};
        const bool accepted = read(address, old);
        if (writes && write(address, data, nullptr)) {
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
        touched_ |= !broadcast;
    } else if (reads) {
        if (read(address, data)) {
            ++wkc;
        }
        touched_ = true;
    } else if (write(address, data, nullptr)) {
        ++wkc;
    }
    d.set_wkc(wkc);
}

void Controller::logical(const DatagramView& d, bool reads, bool writes) noexcept {
    if (!fmmus_.hit(d.address, d.length)) return;
    std::array<std::uint8_t, largest_frame_bytes> copy;
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
        d.set_wkc(static_cast<std::uint16_t>(
            d.wkc() + (did_read ? 1 : 0) + (did_write ? (d.command == Command::lrw ? 2 : 1) : 0)));
        touched_ = true;
        last_frame_ns_ = now_ns_;
    }
}

namespace logical_bits {

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

}  // namespace logical_bits

bool Controller::read_logical(const Fmmus::Unit& unit, const DatagramView& d) noexcept {
    const logical_bits::Part part(unit, d);
    if (part.bits == 0) return false;
    if (unit.bytes) {
        return read(part.address(), {d.data + part.in_frame / 8, part.bytes()});
    }
    std::array<std::uint8_t, largest_frame_bytes> bytes;
    if (!read(part.address(), {bytes.data(), part.bytes()})) return false;
    const std::uint64_t shift = part.in_memory % 8;
    for (std::uint64_t i = 0; i < part.bits; ++i) {
        logical_bits::set_bit(d.data, part.in_frame + i,
                              logical_bits::bit(bytes.data(), shift + i));
    }
    return true;
}

bool Controller::write_logical(const Fmmus::Unit& unit, const DatagramView& d,
                               const std::uint8_t* data) noexcept {
    const logical_bits::Part part(unit, d);
    if (part.bits == 0) return false;
    if (unit.bytes) {
        return write(part.address(), {data + part.in_frame / 8, part.bytes()}, nullptr);
    }
    std::array<std::uint8_t, largest_frame_bytes> bytes, mask;
    std::fill_n(bytes.begin(), part.bytes(), std::uint8_t{0});
    std::fill_n(mask.begin(), part.bytes(), std::uint8_t{0});
    const std::uint64_t shift = part.in_memory % 8;
    for (std::uint64_t i = 0; i < part.bits; ++i) {
        logical_bits::set_bit(bytes.data(), shift + i, logical_bits::bit(data, part.in_frame + i));
        logical_bits::set_bit(mask.data(), shift + i, true);
    }
    const bool outputs = part.address() >= datagram_facts::digital_outputs &&
                         part.address() + part.bytes() <= datagram_facts::digital_outputs_end;
    return write(part.address(), {bytes.data(), part.bytes()},
                 settings_.bit_writes || outputs ? mask.data() : nullptr);
}

bool Controller::read(std::uint32_t address, std::span<std::uint8_t> to) noexcept {
    bool accepted = false;
    if (address < datagram_facts::first_memory) {
        const std::size_t count =
            std::min<std::size_t>(to.size(), datagram_facts::first_memory - address);
        read_registers(static_cast<std::uint16_t>(address), to.first(count));
        accepted = true;
        to = to.subspan(count);
        address += static_cast<std::uint32_t>(count);
    }
    if (to.empty() || address >= ram_end_) return accepted;
    return sms_.read(static_cast<std::uint16_t>(address),
                     to.first(std::min<std::size_t>(to.size(), ram_end_ - address))) ||
           accepted;
}

bool Controller::write(std::uint32_t address, std::span<const std::uint8_t> from,
                       const std::uint8_t* mask) noexcept {
    bool accepted = false;
    touched_ = true;
    if (address < datagram_facts::first_memory) {
        const std::size_t count =
            std::min<std::size_t>(from.size(), datagram_facts::first_memory - address);
        keep_write(static_cast<std::uint16_t>(address), from.first(count));
        accepted = true;
        from = from.subspan(count);
        address += static_cast<std::uint32_t>(count);
        if (mask != nullptr) {
            mask += count;
        }
    }
    if (from.empty() || address >= ram_end_) return accepted;
    const std::size_t count = std::min<std::size_t>(from.size(), ram_end_ - address);
    return sms_.write(static_cast<std::uint16_t>(address), from.first(count), mask) || accepted;
}

}  // namespace hal::ethercat::esc
