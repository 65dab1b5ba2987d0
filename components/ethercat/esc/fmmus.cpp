// SPDX-License-Identifier: MIT
#include "ethercat/esc/fmmus.hpp"

#include <algorithm>

#include "ethercat/wire/byte_order.hpp"
#include "ethercat/wire/registers.hpp"

namespace hal::ethercat::esc {

static bool covers(const Fmmus::Unit& unit, std::uint32_t address) noexcept {
    const std::uint64_t first = unit.physical_bit / 8;
    return first <= address && address < (unit.physical_bit + unit.bits + 7) / 8;
}

void Fmmus::configure() noexcept {
    reset();
    for (unsigned n = 0; n < count_; ++n) {
        const std::uint8_t* at = memory_ + registers::fmmu_at(n);
        const auto length = get<std::uint16_t>(at + 4);
        const unsigned start = at[6] & 7U;
        const unsigned stop = at[7] & 7U;
        const unsigned type = at[11] & 3U;
        if ((at[12] & 1) == 0 || length == 0 || type == 0 || (length == 1 && stop < start)) {
            continue;
        }
        Unit u;
        u.first_bit = std::uint64_t{get<std::uint32_t>(at)} * 8 + start;
        u.bits = (length - 1U) * 8U + stop - start + 1U;
        u.physical_bit = get<std::uint16_t>(at + 8) * 8U + (at[10] & 7U);
        u.reads = (type & 1) != 0;
        u.writes = (type & 2) != 0;
        u.bytes = start == 0 && stop == 7 && (at[10] & 7U) == 0;
        if ((u.physical_bit + u.bits + 7) / 8 > 0x10000) continue;
        first_ = std::min(first_, u.first_bit / 8);
        end_ = std::max(end_, (u.first_bit + u.bits + 7) / 8);
        can_latch_ |= u.writes && covers(u, registers::dc_receive_time);
        units_[used_++] = u;
    }
    const auto meet = [](const Unit& a, const Unit& b) {
        return a.first_bit / 8 <= (b.first_bit + b.bits - 1) / 8 &&
               b.first_bit / 8 <= (a.first_bit + a.bits - 1) / 8;
    };
    for (const Unit& a : *this) {
        for (const Unit& b : *this) {
            overlap_ |= a.reads && b.writes && meet(a, b);
        }
    }
}

}  // namespace hal::ethercat::esc
