// SPDX-License-Identifier: MIT
#include "ethercat/esc/eeprom.hpp"

#include <algorithm>

#include "ethercat/wire/byte_order.hpp"
#include "ethercat/wire/registers.hpp"
#include "ethercat/wire/sii.hpp"

namespace hal::ethercat::esc {

namespace eeprom_bits {
constexpr std::uint16_t write_enable = 0x0001;
constexpr std::uint16_t reads_8 = 0x0040;
constexpr std::uint16_t two_byte_address = 0x0080;
constexpr std::uint16_t commands = 0x0700;
constexpr std::uint16_t read = 0x0100;
constexpr std::uint16_t write = 0x0200;
constexpr std::uint16_t reload = 0x0400;
constexpr std::uint16_t bad_checksum = 0x0800;
constexpr std::uint16_t not_loaded = 0x1000;
constexpr std::uint16_t no_acknowledge = 0x2000;

constexpr std::uint16_t not_enabled = 0x4000;
constexpr std::uint16_t busy = 0x8000;
}  // namespace eeprom_bits

void Eeprom::connect(std::uint8_t* memory, std::vector<std::uint8_t> content, std::int64_t read_ns,
                     std::int64_t write_ns, bool reads_8) {
    memory_ = memory;
    content_ = std::move(content);
    read_ns_ = read_ns;
    write_ns_ = write_ns;

    reads_8_ = reads_8;
    if (content_.size() % 2 != 0) {
        content_.push_back(0xff);
    }
}

void Eeprom::load(std::int64_t) noexcept {
    busy_until_ns_ = chip_busy_until_ns_ = INT64_MIN;
    put(memory_ + registers::eeprom_control,
        static_cast<std::uint16_t>((reads_8_ ? eeprom_bits::reads_8 : 0) |
                                   (content_.size() > 2048 ? eeprom_bits::two_byte_address : 0)));
    reload(true);
}

void Eeprom::reload(bool power_on) noexcept {
    constexpr std::uint16_t ignored_checksum = 0x88a4;
    constexpr std::uint16_t pulse_length = 0x0982;
    constexpr std::size_t checksum_at = 14;
    auto status = get<std::uint16_t>(memory_ + registers::eeprom_control);
    status &= static_cast<std::uint16_t>(~(eeprom_bits::bad_checksum | eeprom_bits::not_loaded));
    loaded_ = content_.size() > checksum_at + 1 && !damaged_ &&
              (get<std::uint16_t>(&content_[checksum_at]) == ignored_checksum ||
               content_[checksum_at] == sii::checksum(content_));
    if (loaded_) {
        std::copy_n(&content_[0], 2, memory_ + registers::pdi_control);
        std::copy_n(&content_[2], 2, memory_ + registers::pdi_control + 0x10);
        std::copy_n(&content_[4], 2, memory_ + pulse_length);
        if (power_on) {
            std::copy_n(&content_[8], 2, memory_ + registers::station_alias);
        }
    } else {
        status |= eeprom_bits::bad_checksum | (power_on ? eeprom_bits::not_loaded : 0);
    }
    put(memory_ + registers::eeprom_control, status);
}

void Eeprom::show_status(std::int64_t now_ns) noexcept {
    const auto status = get<std::uint16_t>(memory_ + registers::eeprom_control);
    const bool busy = now_ns < busy_until_ns_;
    put(memory_ + registers::eeprom_control,
        static_cast<std::uint16_t>(busy ? status | eeprom_bits::busy
                                        : status & ~eeprom_bits::busy));
}

void Eeprom::write(std::uint16_t address, std::span<const std::uint8_t> data,
                   std::int64_t now_ns) noexcept {
    const auto at = [&](unsigned reg) { return static_cast<std::size_t>(reg - address); };
    const auto has = [&](unsigned reg) { return reg >= address && at(reg) < data.size(); };
    if (has(registers::eeprom_configuration)) {
        memory_[registers::eeprom_configuration] = data[at(registers::eeprom_configuration)] & 0x03;
        if ((memory_[registers::eeprom_configuration] & 0x02) != 0) {
            memory_[registers::eeprom_pdi_access] = 0;
        }
    }
    const bool of_pdi = (memory_[registers::eeprom_configuration] & 0x01) != 0 ||
                        (memory_[registers::eeprom_pdi_access] & 0x01) != 0;
    if (of_pdi || now_ns < busy_until_ns_) return;
    for (unsigned reg = registers::eeprom_address; reg < registers::eeprom_data + 8U; ++reg) {
        if (has(reg)) {
            memory_[reg] = data[at(reg)];
        }
    }
    if (!has(registers::eeprom_control + 1U)) return;
    const bool enabled = has(registers::eeprom_control) &&
                         (data[at(registers::eeprom_control)] & eeprom_bits::write_enable) != 0;
    auto status = get<std::uint16_t>(memory_ + registers::eeprom_control);
    status &= static_cast<std::uint16_t>(
        ~(eeprom_bits::commands | eeprom_bits::no_acknowledge | eeprom_bits::not_enabled));
    status |= static_cast<std::uint16_t>((data[at(registers::eeprom_control + 1U)] & 0x07) << 8);
    put(memory_ + registers::eeprom_control, status);
    if ((status & eeprom_bits::commands) != 0) {
        execute(enabled, now_ns);
    }
}

void Eeprom::execute(bool write_enabled, std::int64_t now_ns) noexcept {
    auto status = get<std::uint16_t>(memory_ + registers::eeprom_control);
    const auto command = static_cast<std::uint16_t>(status & eeprom_bits::commands);
    const std::size_t words = std::max<std::size_t>(content_.size() / 2, 1);
    const std::size_t first =
        2 * (get<std::uint32_t>(memory_ + registers::eeprom_address) & 0xffff);
    const auto end_with = [&](std::uint16_t bits) {
        put(memory_ + registers::eeprom_control,
            static_cast<std::uint16_t>((status & ~eeprom_bits::commands) | bits));
    };
    busy_until_ns_ = now_ns + read_ns_;
    if (command == eeprom_bits::write && !write_enabled) {
        return end_with(static_cast<std::uint16_t>(eeprom_bits::not_enabled | command));
    }
    if (failures_ > 0 || now_ns < chip_busy_until_ns_) {
        if (failures_ > 0) {
            --failures_;
        }
        return end_with(static_cast<std::uint16_t>(eeprom_bits::no_acknowledge | command));
    }
    if (command == eeprom_bits::read) {
        for (std::size_t i = 0; i < (reads_8_ ? 8U : 4U); ++i) {
            memory_[registers::eeprom_data + i] = byte(first + i);
        }
    } else if (command == eeprom_bits::write) {
        if (first / 2 < words && first + 1 < content_.size()) {
            std::copy_n(memory_ + registers::eeprom_data, 2, &content_[first]);
        }
        chip_busy_until_ns_ = now_ns + read_ns_ + write_ns_;
    } else if (command == eeprom_bits::reload) {
        reload(false);
        status = get<std::uint16_t>(memory_ + registers::eeprom_control);
    } else {
        return end_with(static_cast<std::uint16_t>(eeprom_bits::no_acknowledge | command));
    }
    end_with(0);
}

}  // namespace hal::ethercat::esc
