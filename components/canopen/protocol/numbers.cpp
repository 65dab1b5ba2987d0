// SPDX-License-Identifier: MIT
#include "numbers.hpp"

#include <array>

namespace hal::canopen {

const char* to_string(Type type) noexcept {
    switch (type) {
    case Type::none: return "";
    case Type::boolean: return "BOOLEAN";
    case Type::integer8: return "INTEGER8";
    case Type::integer16: return "INTEGER16";
    case Type::integer32: return "INTEGER32";
    case Type::unsigned8: return "UNSIGNED8";
    case Type::unsigned16: return "UNSIGNED16";
    case Type::unsigned32: return "UNSIGNED32";
    case Type::real32: return "REAL32";
    case Type::visible_string: return "VISIBLE_STRING";
    case Type::octet_string: return "OCTET_STRING";
    case Type::unicode_string: return "UNICODE_STRING";
    case Type::time_of_day: return "TIME_OF_DAY";
    case Type::time_difference: return "TIME_DIFFERENCE";
    case Type::domain: return "DOMAIN";
    case Type::integer24: return "INTEGER24";
    case Type::real64: return "REAL64";
    case Type::integer40: return "INTEGER40";
    case Type::integer48: return "INTEGER48";
    case Type::integer56: return "INTEGER56";
    case Type::integer64: return "INTEGER64";
    case Type::unsigned24: return "UNSIGNED24";
    case Type::unsigned40: return "UNSIGNED40";
    case Type::unsigned48: return "UNSIGNED48";
    case Type::unsigned56: return "UNSIGNED56";
    case Type::unsigned64: return "UNSIGNED64";
    }
    return "";
}

const char* to_string(Abort code) noexcept {
    switch (code) {
    case Abort::none: return "no error";
    case Abort::toggle: return "toggle bit not alternated";
    case Abort::timeout: return "SDO protocol timed out";
    case Abort::command: return "command specifier not valid or unknown";
    case Abort::block_size: return "invalid block size";
    case Abort::sequence: return "invalid sequence number";
    case Abort::crc: return "CRC error";
    case Abort::memory: return "out of memory";
    case Abort::access: return "unsupported access to an object";
    case Abort::write_only: return "attempt to read a write-only object";
    case Abort::read_only: return "attempt to write a read-only object";
    case Abort::no_object: return "object does not exist in the object dictionary";
    case Abort::not_mappable: return "object cannot be mapped to a PDO";
    case Abort::pdo_length:
        return "number and length of the objects to be mapped would exceed the PDO length";
    case Abort::incompatible: return "general parameter incompatibility";
    case Abort::internal_incompatible: return "general internal incompatibility in the device";
    case Abort::hardware: return "access failed due to a hardware error";
    case Abort::length:
        return "data type does not match, length of service parameter does not match";
    case Abort::too_long: return "data type does not match, length of service parameter too high";
    case Abort::too_short: return "data type does not match, length of service parameter too low";
    case Abort::no_sub: return "sub-index does not exist";
    case Abort::value: return "invalid value for the parameter";
    case Abort::too_high: return "value of the parameter written too high";
    case Abort::too_low: return "value of the parameter written too low";
    case Abort::range_reversed: return "maximum value is less than minimum value";
    case Abort::no_resource: return "resource not available: SDO connection";
    case Abort::general: return "general error";
    case Abort::cannot_store: return "data cannot be transferred or stored to the application";
    case Abort::local_control:
        return "data cannot be transferred or stored because of local control";
    case Abort::device_state:
        return "data cannot be transferred or stored because of the present device state";
    case Abort::no_dictionary:
        return "no object dictionary is present, or it could not be generated";
    case Abort::no_data: return "no data available";
    }
    return "unknown abort code";
}

const char* to_string(NmtState state) noexcept {
    switch (state) {
    case NmtState::initialising: return "initialising";
    case NmtState::stopped: return "stopped";
    case NmtState::operational: return "operational";
    case NmtState::pre_operational: return "pre-operational";
    }
    return "unknown";
}

namespace {
constexpr std::array<std::uint16_t, 256> crc_table = [] {
    std::array<std::uint16_t, 256> table{};
    for (unsigned byte = 0; byte < 256; ++byte) {
        unsigned crc = byte << 8;
        for (int bit = 0; bit < 8; ++bit) {
            crc = (crc & 0x8000) != 0 ? (crc << 1) ^ 0x1021 : crc << 1;
        }
        table[byte] = static_cast<std::uint16_t>(crc);
    }
    return table;
}();
}  // namespace

std::uint16_t crc16(std::span<const std::uint8_t> data, std::uint16_t crc) noexcept {
    for (const auto byte : data) {
        crc = static_cast<std::uint16_t>(crc << 8 ^ crc_table[(crc >> 8 ^ byte) & 0xff]);
    }
    return crc;
}

}  // namespace hal::canopen
