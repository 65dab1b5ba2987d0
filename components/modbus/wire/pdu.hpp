// SPDX-License-Identifier: MIT
// Requests and answers of Modbus without their frame: a function code and its data (application
// protocol V1.1b3, clause 4.1). Numbers of a PDU are big endian.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace hal::modbus {

/// Function codes, clause 6.
enum class Function : std::uint8_t {
    read_coils = 0x01,
    read_discrete = 0x02,
    read_holding = 0x03,
    read_input = 0x04,
    write_coil = 0x05,
    write_register = 0x06,
    write_coils = 0x0f,
    write_registers = 0x10,
};

inline constexpr std::uint8_t exception_flag = 0x80;
inline constexpr std::size_t max_pdu = 253;
inline constexpr std::uint16_t max_read_registers = 125;
inline constexpr std::uint16_t max_read_bits = 2000;
inline constexpr std::uint16_t max_write_registers = 123;
inline constexpr std::uint16_t max_write_bits = 1968;

struct Pdu {
    std::array<std::uint8_t, max_pdu> bytes{};
    std::size_t size = 0;

    std::span<const std::uint8_t> span() const noexcept { return {bytes.data(), size}; }
    std::uint8_t function() const noexcept { return bytes[0]; }
    /// Appends a byte or a number; ignored when the PDU is full. [any]
    void add8(unsigned value) noexcept {
        if (size < max_pdu) {
            bytes[size++] = static_cast<std::uint8_t>(value);
        }
    }
    void add16(unsigned value) noexcept {
        add8(value >> 8);
        add8(value);
    }
};

/// Returns the number at a position. [any]
inline std::uint16_t word_at(std::span<const std::uint8_t> data, std::size_t at) noexcept {
    return static_cast<std::uint16_t>(data[at] << 8 | data[at + 1]);
}

/// A request to read `count` bits or registers. [any]
Pdu read_request(Function function, std::uint16_t address, std::uint16_t count) noexcept;
Pdu write_coil_request(std::uint16_t address, bool on) noexcept;
Pdu write_register_request(std::uint16_t address, std::uint16_t value) noexcept;
/// At most max_write_registers values. [any]
Pdu write_registers_request(std::uint16_t address, std::span<const std::uint16_t> values) noexcept;
/// At most max_write_bits bits, the first one in bit 0 of the first byte. [any]
Pdu write_coils_request(std::uint16_t address, std::uint16_t count,
                        std::span<const std::uint8_t> bits) noexcept;
/// A request of a Huanyang drive of the first dialect: function, number of data bytes, data. Its
/// answers have the same form. [any]
Pdu huanyang_request(std::uint8_t function, std::span<const std::uint8_t> data) noexcept;

/// What an answer is.
enum class Verdict : std::uint8_t {
    good,
    exception,  ///< `code` is its number
    foreign,    ///< of another request
};
struct Answer {
    Verdict verdict = Verdict::foreign;
    std::uint8_t code = 0;
    std::span<const std::uint8_t> data{};  ///< of a read: bits, or registers big endian
};
/// Compares an answer with its request. `huanyang`: both have the form of the first Huanyang
/// dialect. [any]
Answer decode(const Pdu& request, std::span<const std::uint8_t> answer, bool huanyang) noexcept;

/// Returns the name of an exception code, clause 7: "illegal data address". [any]
const char* exception_name(std::uint8_t code) noexcept;
/// Returns "read holding 0x2103..0x2105". [setup]
std::string request_text(const Pdu& request);

}  // namespace hal::modbus
