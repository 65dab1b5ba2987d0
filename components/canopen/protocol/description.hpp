// SPDX-License-Identifier: MIT
// The content of an object dictionary as plain data, whatever its origin: an EDS file, code, a
// test.
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

/// One sub-index of an object; a variable is sub-index 0.
struct EntryDescription {
    std::uint16_t index = 0;
    std::uint8_t sub = 0;
    Type type = Type::unsigned32;
    Access access = Access::read_write;
    bool rpdo = false;
    bool tpdo = false;   ///< may be mapped to an RPDO, to a TPDO of this node
    /// the node ID is added to `value` ($NODEID in EDS files, CiA 306)
    bool plus_node_id = false;
    bool ranged = false;               ///< `low` and `high` apply
    /// limits: integers as such, UNSIGNED64 as the same bits, reals as the bits of a double
    std::int64_t low = 0;
    std::int64_t high = 0;
    /// maximum length of strings and domains in bytes; 0: the length of `value`
    std::uint32_t capacity = 0;
    /// power-on value, little endian; empty: zeros, or an empty string
    std::vector<std::uint8_t> value;
    std::string name;                  ///< ParameterName of EDS files

    /// Allows mapping to RPDOs and TPDOs.
    EntryDescription& mappable() {
        rpdo = tpdo = true;
        return *this;
    }
    /// Allows mapping to TPDOs.
    EntryDescription& sent() {
        tpdo = true;
        return *this;
    }
    /// Allows mapping to RPDOs.
    EntryDescription& received() {
        rpdo = true;
        return *this;
    }
    /// Adds the node ID to the value.
    EntryDescription& with_node_id() {
        plus_node_id = true;
        return *this;
    }
    /// Limits the value to lowest..highest.
    EntryDescription& limited(std::int64_t lowest, std::int64_t highest) {
        ranged = true;
        low = lowest;
        high = highest;
        return *this;
    }
};

/// The objects of a device, in any order. Of duplicate entries the first applies. [setup]
struct Description {
    std::vector<EntryDescription> entries;
    /// names of whole objects, for those with sub-indices
    std::map<std::uint16_t, std::string> objects;

    /// Adds an object with an integer or boolean value and returns it for further settings.
    EntryDescription& add(std::uint16_t index, std::uint8_t sub, Type, Access,
                          std::uint64_t value = 0, std::string name = {});
    /// Adds a REAL32 or REAL64.
    EntryDescription& add_real(std::uint16_t index, std::uint8_t sub, Type, Access,
                               double value = 0, std::string name = {});
    /// Adds a VISIBLE_STRING of at most `capacity` bytes; 0: the length of `text`.
    EntryDescription& add_text(std::uint16_t index, std::uint8_t sub, Access, std::string_view text,
                               std::uint32_t capacity = 0, std::string name = {});
    /// Adds an empty DOMAIN of at most `capacity` bytes.
    EntryDescription& add_domain(std::uint16_t index, std::uint8_t sub, Access,
                                 std::uint32_t capacity, std::string name = {});
    /// Returns the entry or nullptr.
    EntryDescription* find(std::uint16_t index, std::uint8_t sub);
};

/// Identity of a device and sizes of its communication objects.
struct Basics {
    std::uint32_t device_type = 0;
    std::uint32_t vendor = 0;
    std::uint32_t product = 0;
    std::uint32_t revision = 0;
    std::uint32_t serial = 0;
    std::string name{};                 ///< 1008h
    unsigned heartbeat_consumers = 8;   ///< sub-indices of 1016h
    unsigned emcy_consumers = 0;        ///< sub-indices of 1028h
    unsigned error_history = 8;         ///< sub-indices of 1003h
    std::uint16_t heartbeat_ms = 0;     ///< 1017h
};
/// Returns the communication objects of a device: 1000h–1003h, 1005h–1008h, 100Ch–1019h, 1029h,
/// 1200h (CiA 301). [setup]
Description basic_device(const Basics&);

/// Returns a mapping entry of 1600h or 1A00h: index, sub-index, length in bits. [any]
constexpr std::uint32_t map_entry(std::uint16_t index, std::uint8_t sub, unsigned bits) noexcept {
    return std::uint32_t{index} << 16 | std::uint32_t{sub} << 8 | bits;
}

/// Sub-index 0 of a mapping that makes the PDO a multiplexed one (MPDO, CiA 301): each frame names
/// the object whose value it carries, either by its address in the producer (SAM) or in the
/// consumer (DAM).
enum class Multiplex : std::uint8_t { none = 0, source_address = 0xfe, destination_address = 0xff };

/// Communication and mapping parameters of one PDO.
struct PdoDescription {
    /// 0: the predefined COB-ID of PDO 1..4; not valid for the others
    std::uint32_t cob = 0;
    /// adds the node ID to `cob`; the predefined COB-IDs always include it
    bool plus_node_id = false;
    std::uint8_t transmission = 255;   ///< transmission type
    std::uint16_t inhibit_100us = 0;   ///< inhibit time, multiples of 100 us
    std::uint16_t event_ms = 0;        ///< event timer; of an RPDO the deadline
    std::uint8_t sync_start = 0;       ///< SYNC start value
    std::vector<std::uint32_t> mapping{};   ///< see map_entry()
    Multiplex multiplex = Multiplex::none;  ///< other than none: `mapping` is empty
    /// entries that can be mapped, 64 at most; at least those of `mapping`
    unsigned max_mapped = 8;
};
/// Adds RPDO `number`, 1..512: objects 1400h and 1600h + number - 1. [setup]
void add_rpdo(Description&, unsigned number, const PdoDescription&);
/// Adds TPDO `number`, 1..512: objects 1800h and 1A00h + number - 1. [setup]
void add_tpdo(Description&, unsigned number, const PdoDescription&);
/// Adds SDO server `number`, from 0: object 1200h + number. [setup]
void add_sdo_server(Description&, unsigned number, std::uint32_t request_cob,
                    std::uint32_t answer_cob);
/// Adds SDO client `number`, from 0: object 1280h + number; `server` is the node ID of the server.
/// [setup]
void add_sdo_client(Description&, unsigned number, std::uint32_t request_cob,
                    std::uint32_t answer_cob, std::uint8_t server);

}  // namespace hal::canopen
