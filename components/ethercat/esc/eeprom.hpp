// SPDX-License-Identifier: MIT
// The EEPROM interface of an emulated controller (registers 0500h-050Fh) and its content, the SII.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace hal::ethercat::esc {

/// The content stays over power-off.
class Eeprom {
public:
    /// Takes the content. [setup]
    void connect(std::uint8_t* memory, std::vector<std::uint8_t> content, std::int64_t read_ns,
                 std::int64_t write_ns, bool reads_8);
    /// Loads the configuration area at power-on: PDI control, alias, pulse length. [realtime]
    void load(std::int64_t now_ns) noexcept;
    /// Returns whether content and checksum were good. [realtime]
    bool loaded() const noexcept { return loaded_; }
    /// Updates the busy bit at 0502h. [realtime]
    void show_status(std::int64_t now_ns) noexcept;
    /// Takes a write of the master to 0500h-050Fh. [realtime]
    void write(std::uint16_t address, std::span<const std::uint8_t> data,
               std::int64_t now_ns) noexcept;

    /// Returns the SII image. [any]
    std::span<const std::uint8_t> content() const noexcept { return content_; }
    /// Makes the next `count` commands fail without acknowledge of the chip (0502h bit 13).
    /// [realtime]
    void fail(unsigned count) noexcept { failures_ = count; }
    /// Damages the checksum, or repairs it; takes effect at power-on or reload. [realtime]
    void damage(bool damaged) noexcept { damaged_ = damaged; }
    /// Inverts the highest bit of the product code, or restores it. [realtime]
    void falsify(bool wrong) noexcept {
        constexpr std::size_t product_high = 0x17;  // byte 3 of word 0Ah
        if (content_.size() > product_high && wrong != falsified_) {
            content_[product_high] ^= 0x80;
            falsified_ = wrong;
        }
    }

private:
    void execute(bool write_enabled, std::int64_t now_ns) noexcept;
    void reload(bool power_on) noexcept;
    std::uint8_t byte(std::size_t at) const noexcept {
        return at < content_.size() ? content_[at] : 0xff;
    }

    std::uint8_t* memory_ = nullptr;
    std::vector<std::uint8_t> content_;
    std::int64_t read_ns_ = 0;
    std::int64_t write_ns_ = 0;
    std::int64_t busy_until_ns_ = INT64_MIN;

    std::int64_t chip_busy_until_ns_ = INT64_MIN;
    unsigned failures_ = 0;
    bool loaded_ = false;
    bool damaged_ = false;
    bool falsified_ = false;
    bool reads_8_ = true;
};

}  // namespace hal::ethercat::esc
