// SPDX-License-Identifier: MIT
#include "ethercat/wire/coe.hpp"

namespace hal::ethercat::coe {

const char* abort_text(std::uint32_t code) noexcept {
    static constexpr struct {
        std::uint32_t code;
        const char* text;
    } rows[] = {
        {abort::toggle, "toggle bit did not change"},
        {abort::timeout, "SDO protocol timeout"},
        {abort::command, "invalid command specifier"},
        {abort::memory, "out of memory"},
        {abort::access, "unsupported access"},
        {abort::write_only, "object is write-only"},
        {abort::read_only, "object is read-only"},
        {abort::sub0_not_zero, "subindex 0 must be 0 before other entries are written"},
        {abort::no_complete_access, "complete access is not supported"},
        {abort::too_long_for_mailbox, "object is longer than the mailbox"},
        {abort::mapped, "object is mapped to a PDO, download denied"},
        {abort::no_object, "object does not exist"},
        {abort::not_mappable, "object cannot be mapped to a PDO"},
        {abort::pdo_too_long, "mapped objects exceed the PDO length"},
        {abort::parameter, "incompatible parameters"},
        {abort::internal, "internal incompatibility in the device"},
        {abort::hardware, "hardware error"},
        {abort::length, "data type or length does not match"},
        {abort::too_long, "data too long"},
        {abort::too_short, "data too short"},
        {abort::no_sub, "subindex does not exist"},
        {abort::range, "value out of range"},
        {abort::too_high, "value too high"},
        {abort::too_low, "value too low"},
        {abort::max_below_min, "maximum is less than minimum"},
        {abort::general, "general error"},
        {abort::store, "data cannot be stored"},
        {abort::local_control, "data cannot be stored: local control"},
        {abort::state, "data cannot be stored in the present state of the device"},
        {abort::no_dictionary, "object dictionary missing"},
    };
    for (const auto& row : rows) {
        if (row.code == code) return row.text;
    }
    return "unknown abort code";
}

const char* type_name(std::uint16_t t) noexcept {
    static constexpr struct {
        std::uint16_t type;
        const char* text;
    } rows[] = {
        {type::boolean, "BOOL"},
        {type::s8, "SINT"},
        {type::s16, "INT"},
        {type::s32, "DINT"},
        {type::u8, "USINT"},
        {type::u16, "UINT"},
        {type::u32, "UDINT"},
        {type::real32, "REAL"},
        {type::visible_string, "STRING"},
        {type::octet_string, "OCTET_STRING"},
        {type::real64, "LREAL"},
        {type::s64, "LINT"},
        {type::u64, "ULINT"},
        {0x0010, "INT24"},
        {0x0016, "UINT24"},
        {0x001e, "BYTE"},
        {0x001f, "WORD"},
        {0x0020, "DWORD"},
        {0x0030, "BIT1"},
        {0x0031, "BIT2"},
        {0x0032, "BIT3"},
        {0x0033, "BIT4"},
        {0x0034, "BIT5"},
        {0x0035, "BIT6"},
        {0x0036, "BIT7"},
        {0x0037, "BIT8"},
        {type::pdo_mapping, "PDO_MAPPING"},
        {type::identity, "IDENTITY"},
        {type::pdo_parameter, "PDO_PARAMETER"},
    };
    for (const auto& row : rows) {
        if (row.type == t) return row.text;
    }
    return "";
}

}  // namespace hal::ethercat::coe
