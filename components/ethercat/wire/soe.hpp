// SPDX-License-Identifier: MIT
// Servo profile over EtherCAT (ETG.1000.6, clause 5.9; IEC 61800-7-204). All offsets are from the
// start of the payload of the mailbox.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "ethercat/wire/mailbox.hpp"
#include "text/text_table.hpp"

namespace hal::ethercat::soe {

inline constexpr std::size_t header_bytes = 4;
enum class Opcode : std::uint8_t {
    read = 1,
    read_response = 2,
    write = 3,
    write_response = 4,
    notification = 5,
    emergency = 6
};
/// Elements of an IDN; they follow each other in this order.
namespace element {
inline constexpr std::uint8_t state = 0x01;
inline constexpr std::uint8_t name = 0x02;
inline constexpr std::uint8_t attribute = 0x04;
inline constexpr std::uint8_t unit = 0x08;

inline constexpr std::uint8_t minimum = 0x10;
inline constexpr std::uint8_t maximum = 0x20;
inline constexpr std::uint8_t value = 0x40;
inline constexpr std::uint8_t standard = 0x80;
}  // namespace element

struct Header {
    Opcode opcode{};
    bool incomplete = false;   ///< more fragments follow
    bool error = false;        ///< the last two bytes of the payload are a code
    std::uint8_t drive = 0;    ///< 0..7
    std::uint8_t elements = 0;
    std::uint16_t idn = 0;     ///< or the number of fragments left
};
/// Reads the header; nullopt if the payload is too short. [realtime]
inline std::optional<Header> read(std::span<const std::uint8_t> payload) noexcept {
    if (payload.size() < header_bytes) return std::nullopt;
    const std::uint8_t first = payload[0];
    return Header{static_cast<Opcode>(first & 7),
                  (first & 8) != 0,
                  (first & 0x10) != 0,
                  static_cast<std::uint8_t>(first >> 5),
                  payload[1],
                  get<std::uint16_t>(payload.data() + 2)};
}
/// Writes the header. [realtime]
inline void write(std::uint8_t* to, const Header& h) noexcept {
    to[0] = static_cast<std::uint8_t>(static_cast<unsigned>(h.opcode) | (h.incomplete ? 8U : 0U) |
                                      (h.error ? 0x10U : 0U) | (h.drive & 7U) << 5);
    to[1] = h.elements;
    put(to + 2, h.idn);
}
/// Returns the error code of a message with Header::error. [realtime]
inline std::uint16_t error_of(std::span<const std::uint8_t> payload) noexcept {
    return payload.size() < header_bytes + 2
               ? 0
               : get<std::uint16_t>(payload.data() + payload.size() - 2);
}
/// Returns the data bytes of a fragment. [any]
constexpr std::size_t capacity(std::size_t mailbox) noexcept {
    return mailbox - mailbox_header_bytes - header_bytes;
}

/// Returns an IDN: S-0-0024 is idn(false, 0, 24), P-0-150 is idn(true, 0, 150). [any]
constexpr std::uint16_t idn(bool product, unsigned set, unsigned number) noexcept {
    return static_cast<std::uint16_t>((product ? 0x8000U : 0U) | (set & 7) << 12 |
                                      (number & 0xfff));
}
/// [any]
constexpr bool is_product(std::uint16_t idn) noexcept { return (idn & 0x8000) != 0; }
constexpr unsigned set_of(std::uint16_t idn) noexcept { return idn >> 12 & 7; }  ///< [any]
constexpr unsigned number_of(std::uint16_t idn) noexcept { return idn & 0xfff; }  ///< [any]

/// The attribute of an IDN.
struct Attribute {
    std::uint32_t raw = 0;
    /// of the value, or of an element of a list
    constexpr unsigned bytes() const noexcept { return 1U << (raw >> 16 & 3); }
    constexpr bool list() const noexcept { return (raw >> 18 & 1) != 0; }
    constexpr bool command() const noexcept { return (raw >> 19 & 1) != 0; }
    constexpr unsigned type() const noexcept { return raw >> 20 & 7; }
    constexpr bool is_signed() const noexcept { return type() == 2; }
    constexpr unsigned decimals() const noexcept { return raw >> 24 & 15; }
    /// Returns whether writing is denied in PRE-OP (0), SAFE-OP (1) or OP (2).
    constexpr bool write_protected(unsigned state) const noexcept {
        return (raw >> (28 + state) & 1) != 0;
    }
};
/// Types of an attribute.
namespace attribute {
inline constexpr std::uint32_t bytes_1 = 0;
inline constexpr std::uint32_t bytes_2 = 1U << 16;
inline constexpr std::uint32_t bytes_4 = 2U << 16;

inline constexpr std::uint32_t bytes_8 = 3U << 16;
inline constexpr std::uint32_t list = 1U << 18;
inline constexpr std::uint32_t command = 1U << 19;

inline constexpr std::uint32_t is_unsigned = 1U << 20;
inline constexpr std::uint32_t is_signed = 2U << 20;
inline constexpr std::uint32_t hex = 3U << 20;

inline constexpr std::uint32_t text = 4U << 20;
inline constexpr std::uint32_t idn = 5U << 20;
inline constexpr std::uint32_t real = 6U << 20;

inline constexpr std::uint32_t read_only = 7U << 28;
inline constexpr std::uint32_t protected_safeop_op = 6U << 28;
}  // namespace attribute
/// IDNs with the process data of a drive: lists of IDNs, after a control or status word.
inline constexpr std::uint16_t idn_at_list = 16;
inline constexpr std::uint16_t idn_mdt_list = 24;
inline constexpr std::uint16_t idn_control_unit_cycle = 1;

inline constexpr std::uint16_t idn_communication_cycle = 2;
inline constexpr std::uint16_t idn_telegram_type = 15;
inline constexpr std::uint16_t idn_all = 17;

namespace error {
inline constexpr std::uint16_t no_idn = 0x1001;
inline constexpr std::uint16_t no_name = 0x2001;
inline constexpr std::uint16_t name_read_only = 0x2004;

inline constexpr std::uint16_t attribute_read_only = 0x3004;
inline constexpr std::uint16_t no_unit = 0x4001;
inline constexpr std::uint16_t no_minimum = 0x5001;

inline constexpr std::uint16_t no_maximum = 0x6001;
inline constexpr std::uint16_t too_short = 0x7002;
inline constexpr std::uint16_t too_long = 0x7003;

inline constexpr std::uint16_t read_only = 0x7004;
inline constexpr std::uint16_t protected_now = 0x7005;
inline constexpr std::uint16_t below_minimum = 0x7006;

inline constexpr std::uint16_t above_maximum = 0x7007;
inline constexpr std::uint16_t invalid = 0x7008;
inline constexpr std::uint16_t no_drive = 0x800a;

inline constexpr std::uint16_t general = 0x800b;
inline constexpr std::uint16_t no_element = 0x800c;
}  // namespace error
/// Returns the meaning of an error code, as in "value is read-only". [any]
constexpr const char* error_text(std::uint16_t code) noexcept {
    constexpr TextRow<std::uint16_t> rows[] = {
        {0x1001, "IDN does not exist"},
        {0x1009, "invalid access to element 1"},
        {0x2001, "no name"},
        {0x2002, "name too short"},
        {0x2003, "name too long"},
        {0x2004, "name is read-only"},
        {0x2005, "name is write-protected now"},
        {0x3002, "attribute too short"},
        {0x3003, "attribute too long"},
        {0x3004, "attribute is read-only"},
        {0x3005, "attribute is write-protected now"},
        {0x4001, "no unit"},
        {0x4002, "unit too short"},
        {0x4003, "unit too long"},
        {0x4004, "unit is read-only"},
        {0x4005, "unit is write-protected now"},
        {0x5001, "no minimum"},
        {0x5002, "minimum too short"},
        {0x5003, "minimum too long"},
        {0x5004, "minimum is read-only"},
        {0x5005, "minimum is write-protected now"},
        {0x6001, "no maximum"},
        {0x6002, "maximum too short"},
        {0x6003, "maximum too long"},
        {0x6004, "maximum is read-only"},
        {0x6005, "maximum is write-protected now"},
        {0x7002, "value too short"},
        {0x7003, "value too long"},
        {0x7004, "value is read-only"},
        {0x7005, "value is write-protected in this state"},
        {0x7006, "value below the minimum"},
        {0x7007, "value above the maximum"},
        {0x7008, "invalid value"},
        {0x7009, "value is protected by a password"},
        {0x700a, "value is write-protected"},
        {0x700b, "invalid indirect address"},
        {0x700c, "value is write-protected by other settings"},
        {0x7010, "command already active"},
        {0x7011, "command cannot be interrupted"},
        {0x7012, "command cannot be executed now"},
        {0x7013, "command cannot be executed"},
        {0x7014, "no data state"},
        {0x8001, "no default value"},
        {0x8002, "default value too long"},
        {0x8004, "default value is read-only"},
        {0x800a, "invalid drive number"},
        {0x800b, "general error"},
        {0x800c, "no element addressed"}};
    return find_text(rows, code, "unknown SoE error");
}

}  // namespace hal::ethercat::soe
