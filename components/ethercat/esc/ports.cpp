// SPDX-License-Identifier: MIT
#include "ethercat/esc/ports.hpp"

#include "ethercat/wire/byte_order.hpp"
#include "ethercat/wire/registers.hpp"

namespace hal::ethercat::esc {

namespace {

/// The settings of a port in 0101h.
enum class Loop : std::uint8_t { automatic, auto_close, always_open, always_closed };

Loop loop_of(const std::uint8_t* memory, unsigned port) noexcept {
    return static_cast<Loop>(memory[registers::loop_control] >> 2 * port & 3U);
}

void count_up(std::uint8_t& counter) noexcept {
    if (counter < 0xff) {
        ++counter;
    }
}

// DL status
constexpr unsigned eeprom_good = 3;  // loaded, and the firmware runs
constexpr unsigned link_detection = 4;

}  // namespace

bool Ports::set_link(unsigned port, bool up, bool powered) noexcept {
    if (has_link(port) == up) return false;
    const auto bit = static_cast<std::uint8_t>(1U << port);
    link_ ^= bit;
    if (!powered) return false;
    const Loop loop = loop_of(memory_, port);
    const bool closes = loop == Loop::automatic || loop == Loop::auto_close;
    if (!up && closes) {
        count_up(memory_[registers::lost_links + port]);
        if (loop == Loop::auto_close) {
            lost_ |= bit;
        }
    }
    return true;
}

bool Ports::frame_at_closed_port(unsigned port) noexcept {
    if ((lost_ >> port & 1) == 0) return false;
    lost_ = static_cast<std::uint8_t>(lost_ & ~(1U << port));
    return true;
}

bool Ports::opens(unsigned port) const noexcept {
    if (kinds_[port] < PortKind::ebus) return false;
    switch (loop_of(memory_, port)) {
    case Loop::automatic: return has_link(port);
    case Loop::auto_close: return has_link(port) && (lost_ >> port & 1) == 0;
    case Loop::always_open: return true;
    case Loop::always_closed: break;
    }
    return false;
}

bool Ports::update(bool eeprom_loaded) noexcept {
    unsigned open = 0;
    for (unsigned p = 0; p < ports; ++p) {
        if (opens(p)) {
            open |= 1U << p;
        }
    }
    if (open == 0) {
        open = 1;  // all closed: port 0 is taken as open
    }
    open_ = static_cast<std::uint8_t>(open);
    unsigned status = link_detection | static_cast<unsigned>(link_) << 4;
    if (eeprom_loaded) {
        status |= eeprom_good;
    }
    for (unsigned p = 0; p < ports; ++p) {
        if (!is_open(p)) {
            status |= 0x100U << 2 * p;
        } else if (has_link(p)) {
            status |= 0x200U << 2 * p;
        }
    }
    if (get<std::uint16_t>(&memory_[registers::dl_status]) == status) return false;
    put(&memory_[registers::dl_status], static_cast<std::uint16_t>(status));
    return true;
}

void Ports::count_invalid(unsigned port) noexcept {
    count_up(memory_[registers::rx_errors + 2 * port]);
}
void Ports::count_symbol_error(unsigned port) noexcept {
    count_up(memory_[registers::rx_errors + 2 * port + 1]);
}
void Ports::count_forwarded(unsigned port) noexcept {
    count_up(memory_[registers::forwarded_errors + port]);
}
void Ports::count_unit_error() noexcept { count_up(memory_[registers::processing_unit_errors]); }

}  // namespace hal::ethercat::esc
