// SPDX-License-Identifier: MIT
// What an object dictionary holds, as plain data: by whom it was written (an EDS file, code, a test) does not matter here.
//
//     Description d = basic_device({.vendor = 0x1234, .product = 1});
//     d.add(0x2000, 0, Type::integer32, Access::read_write, 7).mappable();
//     add_rpdo(d, 1, {.mapping = {map_entry(0x2000, 0, 32)}});
#pragma once

#include <cstdint>
#include <initializer_list>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "numbers.hpp"

namespace hal::canopen {

/// One sub-index; a plain variable is sub-index 0.
struct EntryDescription {
    std::uint16_t index = 0;
    std::uint8_t sub = 0;
    Type type = Type::unsigned32;
    Access access = Access::read_write;
    bool rpdo = false, tpdo = false;   ///< may be mapped to a PDO received here, sent from here
    bool plus_node_id = false;         ///< `value` is an offset to which the node id is added ($NODEID in EDS files)
    bool ranged = false;               ///< low and high hold
    std::int64_t low = 0, high = 0;    ///< limits of integers; of UNSIGNED64 the same bits; of reals the bits of the double
    std::uint32_t capacity = 0;        ///< room of strings and domains in bytes; 0: as long as the value
    std::vector<std::uint8_t> value;   ///< at power-on, as on the wire; empty: zeros, or an empty string
    std::string name;

    EntryDescription& mappable() { return rpdo = tpdo = true, *this; }
    EntryDescription& sent() { return tpdo = true, *this; }
    EntryDescription& received() { return rpdo = true, *this; }
    EntryDescription& with_node_id() { return plus_node_id = true, *this; }
    EntryDescription& limited(std::int64_t lowest, std::int64_t highest) { return ranged = true, low = lowest, high = highest, *this; }
};

/// All of a device. The order does not matter; of two entries with one address the first counts. [setup]
struct Description {
    std::vector<EntryDescription> entries;
    std::map<std::uint16_t, std::string> objects;  ///< names of whole objects, for those with sub-indices

    EntryDescription& add(std::uint16_t index, std::uint8_t sub, Type, Access, std::uint64_t value = 0, std::string name = {});
    EntryDescription& add_real(std::uint16_t index, std::uint8_t sub, Type, Access, double value = 0, std::string name = {});
    EntryDescription& add_text(std::uint16_t index, std::uint8_t sub, Access, std::string_view text, std::uint32_t capacity = 0,
                               std::string name = {});
    EntryDescription& add_domain(std::uint16_t index, std::uint8_t sub, Access, std::uint32_t capacity, std::string name = {});
    EntryDescription* find(std::uint16_t index, std::uint8_t sub);
};

/// Identity and sizes of a usual device.
struct Basics {
    std::uint32_t device_type = 0, vendor = 0, product = 0, revision = 0, serial = 0;
    std::string name{};                 ///< 1008h
    unsigned heartbeat_consumers = 8;   ///< sub-indices of 1016h
    unsigned emcy_consumers = 0;        ///< sub-indices of 1028h
    unsigned error_history = 8;         ///< sub-indices of 1003h
    std::uint16_t heartbeat_ms = 0;     ///< 1017h
};
/// The communication objects every device of ours has: 1000h–1003h, 1005h–1008h, 100Ch–1019h, 1029h, 1200h. [setup]
Description basic_device(const Basics&);

constexpr std::uint32_t map_entry(std::uint16_t index, std::uint8_t sub, unsigned bits) noexcept {
    return std::uint32_t{index} << 16 | std::uint32_t{sub} << 8 | bits;
}

/// What stands in the count of a mapping when the PDO is a multiplexed one: each frame names the object whose value it carries.
enum class Multiplex : std::uint8_t { none = 0, source_address = 0xfe, destination_address = 0xff };

/// Communication and mapping parameters of one PDO.
struct PdoDescription {
    std::uint32_t cob = 0;             ///< 0: the predefined one of PDO 1–4, none of the others
    bool plus_node_id = false;         ///< of `cob`; the predefined ones always are
    std::uint8_t transmission = 255;
    std::uint16_t inhibit_100us = 0, event_ms = 0;
    std::uint8_t sync_start = 0;
    std::vector<std::uint32_t> mapping{};
    Multiplex multiplex = Multiplex::none;  ///< with it `mapping` is empty
    unsigned room = 8;                 ///< entries that can be mapped, at least those of `mapping`, at most 64
};
/// PDO `number` counts from 1. [setup]
void add_rpdo(Description&, unsigned number, const PdoDescription&);
void add_tpdo(Description&, unsigned number, const PdoDescription&);
/// A further SDO server (1201h …) or a client (1280h …), `number` from 0. COB-IDs as the object holds them. [setup]
void add_sdo_server(Description&, unsigned number, std::uint32_t request_cob, std::uint32_t answer_cob);
void add_sdo_client(Description&, unsigned number, std::uint32_t request_cob, std::uint32_t answer_cob, std::uint8_t server);

}  // namespace hal::canopen
