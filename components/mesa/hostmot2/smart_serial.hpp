// SPDX-License-Identifier: MIT
// Smart serial: the commands to a port, and the tables in which a remote device describes itself.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace hal::mesa::smart_serial {

inline constexpr unsigned command = 0, data = 1;  ///< registers of a port
/// Registers of a channel, which is at the address + 4 x channel: command and status, then the
/// user registers: three, or seven of the wide module.
inline constexpr unsigned control_status = 2, user = 3;
inline constexpr unsigned max_channels = 8;

/// Values of the command register, which reads as 0 when the command is done.
namespace port {
inline constexpr std::uint32_t reset = 0x4000;
inline constexpr std::uint32_t clear = 0x0001;
inline constexpr std::uint32_t read_local = 0x2000;
inline constexpr std::uint32_t write_local = 0xa000;
inline constexpr std::uint32_t stop_all = 0x0800;
inline constexpr std::uint32_t start = 0x0900;
inline constexpr std::uint32_t start_setup = 0x0f00;
inline constexpr std::uint32_t do_it = 0x1000;
inline constexpr std::uint32_t ignored = 0x80000000;
}  // namespace port
/// Local bytes of a port.
namespace local {
inline constexpr std::uint32_t version = 3, channel_offset = 4, channel_stride = 5, channels = 7;
inline constexpr std::uint8_t usual_version = 43, not_ready = 0xaa;
}  // namespace local

/// Requests to a remote device in the CS register: the request in bits 24..31, an address in bits
/// 0..15. `read` + n and `write` + n access 2^n bytes, which are in user register 0. `read_byte`
/// reads one byte of the tables; hosts use it to find out what a device has.
namespace remote {
inline constexpr std::uint32_t read = 0x44, read_byte = 0x4c, write = 0x64, non_volatile = 0xec;
constexpr std::uint32_t request(std::uint32_t code, std::uint16_t address) noexcept {
    return code << 24 | address;
}
}  // namespace remote

/// Bits of the CS register as it is read.
inline constexpr std::uint32_t remote_fault = 1U << 8, communication_error = 1U << 13;

enum class RecordType : std::uint8_t {
    pad = 0,
    bits = 1,
    unsigned_number = 2,
    signed_number = 3,
    non_volatile_unsigned = 4,
    non_volatile_signed = 5,
    stream = 6,
    boolean = 7,
    encoder = 8,
    float_number = 0x10,
    split_encoder_high = 0x18,
    split_encoder_low = 0x28,
};
enum class Direction : std::uint8_t { in = 0x00, both = 0x40, out = 0x80 };

/// A record of process data or a global value (first byte A0h).
struct Record {
    static constexpr std::uint8_t mark = 0xa0;
    std::uint8_t bits = 0;
    RecordType type = RecordType::pad;
    Direction direction = Direction::in;
    float min = 0.0F;
    float max = 0.0F;
    std::uint16_t address = 0;
    std::string unit;
    std::string name;
    friend bool operator==(const Record&, const Record&) = default;
};
/// A mode of the device (first byte B0h).
struct ModeRecord {
    static constexpr std::uint8_t mark = 0xb0;
    std::uint8_t index = 0;
    std::uint8_t type = 0;  ///< 1: chosen by software
    std::string name;
    friend bool operator==(const ModeRecord&, const ModeRecord&) = default;
};

std::vector<std::uint8_t> encode(const Record& record);
std::vector<std::uint8_t> encode(const ModeRecord& record);
/// Decodes a record that begins with the bytes. Returns nothing if it is not one, or not complete;
/// names are at most 48 characters. [setup]
std::optional<Record> decode_record(std::span<const std::uint8_t> bytes);
std::optional<ModeRecord> decode_mode(std::span<const std::uint8_t> bytes);

/// Copies `count` bits, 1..64, from bit `offset` of the words; bits beyond them are 0. [any]
std::uint64_t take_bits(std::span<const std::uint32_t> words, unsigned offset,
                        unsigned count) noexcept;
/// Stores `count` bits, 1..64, at bit `offset` of the words; bits beyond them are dropped. [any]
void put_bits(std::span<std::uint32_t> words, unsigned offset, unsigned count,
              std::uint64_t value) noexcept;

}  // namespace hal::mesa::smart_serial
