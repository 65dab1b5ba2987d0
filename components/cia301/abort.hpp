// SPDX-License-Identifier: MIT
// SDO abort codes: why an SDO transfer or an access to the dictionary failed (CiA 301, clause
// 7.2.4.3.17; ETG.1000.6, clause 5.6.2.7 adds those of complete access).
#pragma once

#include <cstdint>

namespace hal::cia301 {

enum class Abort : std::uint32_t {
    none = 0,
    toggle = 0x05030000,
    timeout = 0x05040000,
    command = 0x05040001,
    block_size = 0x05040002,
    sequence = 0x05040003,
    crc = 0x05040004,
    memory = 0x05040005,
    access = 0x06010000,
    write_only = 0x06010001,
    read_only = 0x06010002,
    sub0_not_zero = 0x06010003,         ///< EtherCAT
    no_complete_access = 0x06010004,    ///< EtherCAT
    too_long_for_mailbox = 0x06010005,  ///< EtherCAT
    mapped = 0x06010006,                ///< EtherCAT
    no_object = 0x06020000,
    not_mappable = 0x06040041,
    pdo_length = 0x06040042,
    incompatible = 0x06040043,
    internal_incompatible = 0x06040047,
    hardware = 0x06060000,
    length = 0x06070010,
    too_long = 0x06070012,
    too_short = 0x06070013,
    no_sub = 0x06090011,
    value = 0x06090030,
    too_high = 0x06090031,
    too_low = 0x06090032,
    range_reversed = 0x06090036,
    no_resource = 0x060a0023,
    general = 0x08000000,
    cannot_store = 0x08000020,
    local_control = 0x08000021,
    device_state = 0x08000022,
    no_dictionary = 0x08000023,
    no_data = 0x08000024,
};

/// Returns the number that a frame carries. [any]
constexpr std::uint32_t code_of(Abort abort) noexcept { return static_cast<std::uint32_t>(abort); }
/// Returns `why` if the condition is true, else none. [any]
constexpr Abort abort_if(bool condition, Abort why) noexcept {
    return condition ? why : Abort::none;
}
/// Returns the description of the abort code; "unknown abort code" if it is not listed above. [any]
const char* to_string(Abort) noexcept;

}  // namespace hal::cia301
