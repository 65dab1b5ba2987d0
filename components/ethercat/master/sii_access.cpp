// SPDX-License-Identifier: MIT
#include "ethercat/master/sii_access.hpp"

#include "ethercat/wire/registers.hpp"

namespace hal::ethercat::master {

namespace {

constexpr std::uint16_t eeprom_busy = 0x8000;
constexpr std::uint16_t eeprom_wide = 0x0040;
constexpr std::uint16_t eeprom_no_acknowledge = 0x2000;

constexpr std::uint16_t eeprom_write_enable_error = 0x4000;
constexpr std::uint16_t eeprom_read = 0x0100;
constexpr std::uint16_t eeprom_write = 0x0201;
constexpr std::int64_t eeprom_timeout_ns = 100'000'000;
constexpr unsigned eeprom_tries = 6;
constexpr std::uint16_t state_and_data = 14;  ///< 0502h to 050Fh

}  // namespace

Task<SiiData> sii_read(Channel& c, std::uint16_t station, std::uint32_t word) noexcept {
    SiiData result;
    unsigned have = 0;
    for (unsigned tries = 0; tries < eeprom_tries && have < 4;) {
        put(c.data(), eeprom_read);
        put(c.data() + 2, word + have);
        Answer a =
            co_await c.exchange(Command::fpwr, at_station(station, registers::eeprom_control), 6);
        if (a.wkc != 1) {
            ++tries;
            continue;
        }
        const std::int64_t until = c.now_ns() + eeprom_timeout_ns;
        do {
            a = co_await c.exchange(Command::fprd, at_station(station, registers::eeprom_control),
                                    state_and_data);
            result.control = get<std::uint16_t>(c.data());
        } while (a.wkc == 1 && (result.control & eeprom_busy) != 0 && c.now_ns() < until);
        const bool failed = a.wkc != 1 || (result.control & (eeprom_busy | eeprom_no_acknowledge |
                                                             eeprom_write_enable_error)) != 0;
        if (failed) {
            ++tries;
            put<std::uint16_t>(c.data(), 0);
            co_await c.exchange(Command::fpwr, at_station(station, registers::eeprom_control), 2);
            continue;
        }
        const unsigned got = (result.control & eeprom_wide) != 0 ? 4 : 2;
        for (unsigned n = 0; n < got && have < 4; ++n) {
            result.words[have++] = get<std::uint16_t>(c.data() + 6 + std::size_t{2} * n);
        }
    }
    result.ok = have == 4;
    co_return result;
}

Task<bool> sii_write(Channel& c, std::uint16_t station, std::uint32_t word,
                     std::uint16_t value) noexcept {
    const std::int64_t until = c.now_ns() + eeprom_timeout_ns;
    while (c.now_ns() < until) {
        put(c.data(), value);
        Answer a =
            co_await c.exchange(Command::fpwr, at_station(station, registers::eeprom_data), 2);
        if (a.wkc != 1) continue;
        put(c.data(), eeprom_write);
        put(c.data() + 2, word);
        a = co_await c.exchange(Command::fpwr, at_station(station, registers::eeprom_control), 6);
        if (a.wkc != 1) continue;
        std::uint16_t control = 0;
        do {
            a = co_await c.exchange(Command::fprd, at_station(station, registers::eeprom_control),
                                    2);
            control = get<std::uint16_t>(c.data());
        } while (a.wkc == 1 && (control & eeprom_busy) != 0 && c.now_ns() < until);
        // The part that stores the previous word does not acknowledge; the command is repeated
        // then.
        if (a.wkc == 1 &&
            (control & (eeprom_busy | eeprom_no_acknowledge | eeprom_write_enable_error)) == 0) {
            co_return true;
        }
    }
    co_return false;
}

}  // namespace hal::ethercat::master
