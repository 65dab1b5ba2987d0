// SPDX-License-Identifier: MIT
#include "ethercat/esc/sync_managers.hpp"

#include <algorithm>
#include <bit>
#include <cstring>

#include "ethercat/wire/byte_order.hpp"
#include "ethercat/wire/registers.hpp"

namespace hal::ethercat::esc {

namespace sm_bytes {
constexpr unsigned size = 8;
constexpr unsigned control = 4;
constexpr unsigned status = 5;
constexpr unsigned activate = 6;
constexpr unsigned pdi_control = 7;
constexpr std::size_t memory_size = 0x10000;
}  // namespace sm_bytes

void SyncManagers::reset() noexcept {
    units_.fill({});
    enabled_ = 0;
    pending_ = false;
}

bool SyncManagers::configure(std::uint16_t address, std::span<const std::uint8_t> data) noexcept {
    bool changed = false;
    for (std::size_t i = 0; i < data.size(); ++i) {
        const unsigned reg = address + static_cast<unsigned>(i) - registers::sync_manager;
        const unsigned number = reg / sm_bytes::size;
        const unsigned field = reg % sm_bytes::size;
        if (address + i < registers::sync_manager || number >= count_) continue;
        std::uint8_t& byte = memory_[address + i];
        if (field <= sm_bytes::control) {
            if (!units_[number].enabled) {
                byte = data[i];
            }
        } else if (field == sm_bytes::activate) {
            byte = data[i];
            const bool on = (data[i] & 1) != 0;
            if (on != units_[number].enabled) {
                activate(number, on);
                changed = true;
            }
        }
    }
    return changed;
}

void SyncManagers::activate(unsigned number, bool on) noexcept {
    const std::uint8_t* at = memory_ + registers::sync_manager_at(number);
    Unit u;
    u.start = get<std::uint16_t>(at);
    u.length = get<std::uint16_t>(at + 2);
    u.mailbox = (at[sm_bytes::control] & 0x03) == 0x02;
    u.ecat_writes = (at[sm_bytes::control] & 0x0c) == 0x04;
    u.watchdog = (at[sm_bytes::control] & 0x40) != 0;
    const std::size_t buffers = u.mailbox || u.length == 1 ? 1 : 3;
    u.enabled = on;
    constexpr unsigned first_memory = 0x0f00;  // registers of digital outputs are process data too
    const bool fits = on && u.length > 0 && u.start >= first_memory &&
                      u.start + buffers * u.length <= sm_bytes::memory_size;
    units_[number] = u;
    enabled_ = fits ? enabled_ | 1U << number : enabled_ & ~(1U << number);
}

void SyncManagers::show_status(std::uint16_t address, std::size_t length) noexcept {
    const unsigned from = std::max<unsigned>(address, registers::sync_manager);
    const auto end = static_cast<unsigned>(address + length);
    for (unsigned n = (from - registers::sync_manager) / sm_bytes::size;
         n < count_ && registers::sync_manager_at(n) < end; ++n) {
        const Unit& u = units_[n];
        unsigned status = static_cast<unsigned>(u.fresh) | static_cast<unsigned>(u.read_event) << 1;
        if (u.mailbox) {
            status |= u.full ? 0x08U : 0U;
        } else {
            status |= static_cast<unsigned>(u.latest) << 4;
        }
        memory_[registers::sync_manager_at(n) + sm_bytes::status] =
            static_cast<std::uint8_t>(status);
    }
}

/// Returns the enabled sync manager at an address, nullptr: none; `until` is lowered to where that
/// changes.
const SyncManagers::Unit* SyncManagers::at(std::uint32_t address,
                                           std::uint32_t& until) const noexcept {
    for (unsigned left = enabled_; left != 0; left &= left - 1) {
        const Unit& u = units_[static_cast<unsigned>(std::countr_zero(left))];
        if (u.start > address) {
            until = std::min(until, u.start);
        } else if (address < u.start + u.length) {
            until = std::min(until, u.start + u.length);
            return &u;
        }
    }
    return nullptr;
}

bool SyncManagers::read(std::uint16_t address, std::span<std::uint8_t> to) noexcept {
    bool accepted = false;
    std::uint32_t position = address;
    const auto end = static_cast<std::uint32_t>(address + to.size());
    while (position < end) {
        std::uint32_t until = end;
        const Unit* unit = at(position, until);
        const auto part = to.subspan(position - address, until - position);
        if (unit == nullptr) {
            std::memcpy(part.data(), memory_ + position, part.size());
            accepted = true;
        } else {
            accepted |= read(const_cast<Unit&>(*unit), position - unit->start, part);
        }
        position = until;
    }
    return accepted;
}

bool SyncManagers::write(std::uint16_t address, std::span<const std::uint8_t> from,
                         const std::uint8_t* mask) noexcept {
    bool accepted = false;
    std::uint32_t position = address;
    const auto end = static_cast<std::uint32_t>(address + from.size());
    while (position < end) {
        std::uint32_t until = end;
        const Unit* unit = at(position, until);
        const std::size_t offset = position - address;
        const auto part = from.subspan(offset, until - position);
        const std::uint8_t* bits = mask != nullptr ? mask + offset : nullptr;
        if (unit == nullptr) {
            for (std::size_t i = 0; i < part.size(); ++i) {
                const std::uint8_t m = bits != nullptr ? bits[i] : 0xff;
                memory_[position + i] =
                    static_cast<std::uint8_t>((memory_[position + i] & ~m) | (part[i] & m));
            }
            accepted = true;
        } else {
            accepted |= write(const_cast<Unit&>(*unit), position - unit->start, part, bits);
        }
        position = until;
    }
    return accepted;
}

bool SyncManagers::read(Unit& u, std::uint32_t offset, std::span<std::uint8_t> to) noexcept {
    if (u.ecat_writes || (u.mailbox && !u.full)) return false;
    if (offset == 0) {
        u.open = true;
        u.reader = u.latest == none ? 0 : u.latest;
    }
    if (!u.open) return false;
    std::memcpy(to.data(), buffer(u, u.reader) + offset, to.size());
    if (offset + to.size() == u.length) {
        u.open = false;
        u.closed = pending_ = true;
    }
    return true;
}

bool SyncManagers::write(Unit& u, std::uint32_t offset, std::span<const std::uint8_t> from,
                         const std::uint8_t* mask) noexcept {
    if (!u.ecat_writes || (u.mailbox && (u.full || u.closed))) return false;
    if (offset == 0) {
        if (!u.open && !u.closed && !u.mailbox) {
            u.writer = u.latest >= 2 ? 0 : static_cast<std::uint8_t>(u.latest + 1);
            if (mask != nullptr && u.latest != none && u.length > 1) {
                std::memcpy(buffer(u, u.writer), buffer(u, u.latest), u.length);
            }
        }
        u.open = true;
    }
    if (!u.open) return false;
    std::uint8_t* to = buffer(u, u.writer) + offset;
    if (mask == nullptr) {
        std::memcpy(to, from.data(), from.size());
    } else {
        for (std::size_t i = 0; i < from.size(); ++i) {
            to[i] = static_cast<std::uint8_t>((to[i] & ~mask[i]) | (from[i] & mask[i]));
        }
    }
    if (offset + from.size() == u.length) {
        u.open = false;
        u.closed = pending_ = true;
    }
    return true;
}

SyncManagers::Committed SyncManagers::commit() noexcept {
    Committed done;
    for (unsigned left = enabled_; left != 0; left &= left - 1) {
        const auto n = static_cast<unsigned>(std::countr_zero(left));
        Unit& u = units_[n];
        if (!u.closed) continue;
        u.closed = false;
        if (u.ecat_writes) {
            u.latest = u.writer;
            u.full = u.mailbox;
            u.fresh = true;
            done.written |= 1U << n;
            done.watchdog |= u.watchdog;
        } else {
            u.full = false;
            u.read_event = true;
            done.read |= 1U << n;
        }
    }
    pending_ = false;
    return done;
}

Pdi::SyncManager SyncManagers::settings(unsigned number) const noexcept {
    Pdi::SyncManager s;
    if (number >= count_) return s;
    const std::uint8_t* at = memory_ + registers::sync_manager_at(number);
    s.start = get<std::uint16_t>(at);
    s.length = get<std::uint16_t>(at + 2);
    s.control = at[sm_bytes::control];
    s.enabled = (at[sm_bytes::activate] & 1) != 0;
    s.repeat_request = (at[sm_bytes::activate] & 2) != 0;
    return s;
}

std::size_t SyncManagers::pdi_read(unsigned number, std::span<std::uint8_t> to) noexcept {
    if (number >= count_ || (enabled_ & 1U << number) == 0) return 0;
    Unit& u = units_[number];
    if (!u.ecat_writes || !u.fresh) return 0;
    const std::size_t count = std::min<std::size_t>(to.size(), u.length);
    std::memcpy(to.data(), buffer(u, u.latest), count);
    u.fresh = u.full = false;
    return count;
}

bool SyncManagers::pdi_write(unsigned number, std::span<const std::uint8_t> from) noexcept {
    if (number >= count_ || (enabled_ & 1U << number) == 0) return false;
    Unit& u = units_[number];
    if (u.ecat_writes || u.full) return false;
    if (!u.mailbox) {
        do {
            u.writer = u.writer >= 2 ? 0 : static_cast<std::uint8_t>(u.writer + 1);
        } while (u.writer == u.latest || (u.open && u.writer == u.reader));
    }
    std::uint8_t* to = buffer(u, u.writer);
    const std::size_t count = std::min<std::size_t>(from.size(), u.length);
    if (count != 0) {
        std::memcpy(to, from.data(), count);
    }
    std::memset(to + count, 0, u.length - count);
    u.latest = u.writer;
    u.full = u.mailbox;
    u.read_event = false;
    return true;
}

void SyncManagers::acknowledge_repeat(unsigned number) noexcept {
    if (number >= count_) return;
    std::uint8_t* at = memory_ + registers::sync_manager_at(number);
    at[sm_bytes::pdi_control] = static_cast<std::uint8_t>((at[sm_bytes::pdi_control] & ~2U) |
                                                          (at[sm_bytes::activate] & 2U));
}

bool SyncManagers::watched() const noexcept {
    return std::any_of(units_.begin(), units_.end(),
                       [](const Unit& u) { return u.enabled && u.watchdog; });
}

}  // namespace hal::ethercat::esc
